#!/usr/bin/env bash
# Builds the page that shows Bullet and LazyCCD side by side, and serves it on this machine.
#
#   bash examples/web/run.sh                 builds build/web and serves it on port 8080
#   bash examples/web/run.sh --port 9000
#   bash examples/web/run.sh --build         builds it only; any static host can serve the folder
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"

port=8080
serve=yes
while [ $# -gt 0 ]; do
  case $1 in
    --build) serve=no ;;
    --port) port=$2 && shift ;;
    *) sed -n '4,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
  esac
  shift
done

require_packages core web
build_wasm -DLAZYCCD_TESTS=OFF -DLAZYCCD_EXAMPLES=ON -- lazyccd_page
site=$repository/build/web
mkdir -p "$site"
cp "$repository"/examples/web/page/* "$repository/plugin/javascript/instantiate.js" "$repository/build/wasm/examples/web/page.wasm" \
  /usr/share/javascript/three/three.module.js "$site"
cp /usr/share/doc/libjs-three/copyright "$site/three.LICENSE.txt"
say "The page is in $site"
if [ $serve = yes ]; then
  say "Serving it on http://127.0.0.1:$port/ until Ctrl-C"
  python3 -m http.server --bind 127.0.0.1 --directory "$site" "$port"
fi
