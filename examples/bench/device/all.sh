# What examples/bench/all.sh runs for the page gpu.
out=$results/gpu
folder=$work/gpu  # as tests/gpu/run.sh wants it: programs, and pairs of frames NAME0.ply and NAME1.ply
logs=$work/gpu_out

require_packages core bullet programs pictures
build_preset cuda -DLAZYCCD_TESTS=ON
mkdir -p $folder $logs
cp build/cuda/tests/gpu/check_* build/cuda/examples/lazyccd $folder
frames=()
for scene in "${LAZYCCD_DATA_DIR:-shared/data}"/frames/*/; do
  pair=("$scene"frames/*.ply)
  for i in 0 1; do cp "${pair[i]}" "$folder/$(basename "$scene")$i.ply"; done
  frames+=("$folder/$(basename "$scene")0.ply" "$folder/$(basename "$scene")1.ply")
done

# Checks everything before it times anything.
run bash tests/gpu/run.sh $folder $logs
for part in detections stages; do
  mode=$([ $part = stages ] && echo '"stages' || echo '"graph"|"from the root"')
  { head -n 1 $logs/bench.csv && grep -E "$mode" $logs/bench.csv; } >$out/$part.csv
done
python3 examples/bench/device/log_csv.py hierarchy $logs/hierarchy.log $out/hierarchy.csv
python3 examples/bench/device/log_csv.py steps $logs/drop.log $out/steps.csv
files=(gpu/detections gpu/stages gpu/hierarchy gpu/steps)
if [ -e $logs/bounds.csv ]; then  # needs ncu
  cp $logs/bounds.csv $out
  files+=(gpu/bounds)
fi
note "${files[@]/%/.csv}"

run build/cuda/examples/bench/lazyccd_device_costs "${frames[@]}" >$logs/exact.log
python3 examples/bench/device/log_csv.py exact $logs/exact.log $out/exact.csv
note gpu/exact.csv
if [ -n "${LAZYCCD_BEFORE:-}" ]; then  # the program lazyccd of an earlier commit
  run python3 examples/bench/device/large_steps.py build/cuda/examples/lazyccd "$LAZYCCD_BEFORE" $out/large_steps.csv
  note gpu/large_steps.csv
fi
run build/cuda/examples/bench/lazyccd_device_choice --steps 12000 >$out/choice.csv
note gpu/choice.csv
run build/cuda/examples/bench/lazyccd_device_scaling >$out/scaling.csv
/usr/bin/python3 examples/bench/device/scaling.py $out/scaling.csv --chart $out/scaling.png
note gpu/scaling.csv
