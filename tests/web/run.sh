#!/usr/bin/env bash
# Builds LazyCCD for WebAssembly and tests it: core and adapter under node, the hashes of detections against a
# native build, the package for JavaScript with its types and recipes, and the page in Chromium.
#
#   bash tests/web/run.sh            all; the last result is in results.md
#   bash tests/web/run.sh --page     the page alone
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../examples/setup.sh"

page_only=no
case ${1:-} in
  '') ;;
  --page) page_only=yes ;;
  *) sed -n '5,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac

here=$repository/tests/web
wasm=$repository/build/wasm
out=$repository/build/web_results
mkdir -p "$out"
summary=()
# run_stage NAME COMMAND...
run_stage() {
  local name=$1 start=$SECONDS
  shift
  say "$name"
  "$@"
  summary+=("$name: passed in $((SECONDS - start)) s")
}
# node --no-experimental-fetch: scripts of Debian's compiler take a node with fetch() for a browser.
run_catch() {
  LAZYCCD_QUICK_TESTS=1 node --no-experimental-fetch "$wasm/tests/$1.js" | tee "$out/$1.txt" | tail -3
}
compare_hashes() {
  "$repository/build/cpu/tests/lazyccd_frame_hashes" >"$out/hashes_native.txt"
  node --no-experimental-fetch "$wasm/tests/lazyccd_frame_hashes.js" >"$out/hashes_wasm.txt"
  # Sine and cosine of two C libraries may differ in the last bit, so few frames may have other positions.
  python3 "$here/compare_hashes.py" "$out/hashes_native.txt" "$out/hashes_wasm.txt"
}
test_package() {
  PACKAGE=$wasm/plugin/javascript/package node --test "$here"/test_*.mjs >"$out/package.txt" || { cat "$out/package.txt"; return 1; }
  grep -E '^# (pass|fail|skipped)' "$out/package.txt"
  tsc --noEmit --strict --target es2022 --module es2022 --moduleResolution node "$here/types.ts"
}
test_page() {
  bash "$repository/examples/web/run.sh" --build
  "$repository/build/cpu/examples/web/lazyccd_page_scenes" 300 >"$out/scenes_native.jsonl"
  /usr/bin/python3 "$here/test_page.py" "$repository/build/web" "$out/scenes_native.jsonl" "$out/pictures"
}

require_packages core bullet programs tests web browser
start=$SECONDS
build_preset cpu -DLAZYCCD_TESTS=ON -- lazyccd_page_scenes lazyccd_frame_hashes
if [ $page_only = no ]; then
  build_wasm -DLAZYCCD_TESTS=ON -DLAZYCCD_EXAMPLES=ON -- lazyccd_javascript lazyccd_page lazyccd_tests lazyccd_tests_bullet \
    lazyccd_frame_hashes
  summary+=("built in $((SECONDS - start)) s")
  run_stage "core under node" run_catch lazyccd_tests
  run_stage "adapter under node" run_catch lazyccd_tests_bullet
  run_stage "hashes of detections" compare_hashes
  run_stage "package" test_package
fi
run_stage "page" test_page
say "All passed"
printf '%s\n' "${summary[@]}"
