#!/usr/bin/env bash
# Builds the package for JavaScript in build/wasm/plugin/javascript/package, with all set-up.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"

require_packages core web
build_wasm -DLAZYCCD_TESTS=OFF -DLAZYCCD_EXAMPLES=OFF -- lazyccd_javascript
say "The package is in $repository/build/wasm/plugin/javascript/package"
