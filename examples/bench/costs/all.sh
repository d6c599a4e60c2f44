# What examples/bench/all.sh runs for the page costs.
out=$results/costs

require_packages core bullet programs tests pictures
build_preset cpu -- lazyccd lazyccd_double lazyccd_phase_costs lazyccd_sleeper_costs lazyccd_scene_costs
for world in rigid deformable; do
  rounds=$([ $world = rigid ] && echo 3 || echo 1)
  run $bench/lazyccd_scene_costs --rounds "$rounds" --only untuned --world $world --cpu-time --csv $work/$world.csv
done
joined $work/rigid.csv $work/deformable.csv >$out/untuned.csv
note costs/untuned.csv

run bash examples/bench/costs/scene_costs.sh --rounds 1 --cpu-time
joined build/scene_costs/costs.csv build/scene_costs/costs_double.csv >$out/scenes.csv
note costs/scenes.csv

run bash examples/run.sh
python3 "$here/stats_csv.py" $results/drop/drop.csv "Bullet alone=build/drop/bullet/stats.json" \
  LazyCCD=build/drop/lazyccd/stats.json
cp build/drop/drop.png $results/drop
note drop/drop.csv

thrown=(--world rigid --speed 2 --size 0.5 --dt 0.00417)
for i in 1 2 3 4 5 6 7; do
  run $programs/lazyccd simulate cloth-on-cloth "${thrown[@]}" --detector bullet --stats $work/bullet$i.json
  run $programs/lazyccd simulate cloth-on-cloth "${thrown[@]}" --stats $work/lazyccd$i.json
  [ $i = 7 ] || commands=()
done
python3 "$here/stats_csv.py" $out/thrown.csv "Bullet alone=$(echo $work/bullet?.json)" \
  "LazyCCD=$(echo $work/lazyccd?.json)"
note costs/thrown.csv

build_preset cpu -DLAZYCCD_TESTS=ON -- lazyccd_stretch
run build/cpu/tests/lazyccd_stretch >$work/stretch || true # it fails where a link is beyond its bound
{ echo "scene,nodes,amount,steps a second,bound,beyond,Bullet longest,Bullet at the end,LazyCCD longest,LazyCCD at the end,\
Bullet m/s,LazyCCD m/s,Bullet ms,LazyCCD ms" && cells $work/stretch; } >$out/stretch.csv
note costs/stretch.csv

run /usr/bin/python3 examples/bench/no_regression.py $programs --times-csv $out/right.csv
note costs/right.csv

echo "precision,nodes,links,iterations,Bullet us,LazyCCD us" >$out/links.csv
for precision in float double; do
  run $bench/lazyccd_link_costs"$([ $precision = float ] || echo _double)" >$work/links
  cells $work/links | cut -d, -f1-5 | sed "s/^/$precision,/" >>$out/links.csv
done
note costs/links.csv

# With a line for the GPU, if the machine has one.
sized=($programs/lazyccd)
if command -v nvidia-smi >/dev/null; then
  build_preset cuda -- lazyccd
  sized=(build/cuda/examples/lazyccd --gpu)
fi
run /usr/bin/python3 examples/bench/costs/size_chart.py "${sized[@]}" --limit 6 --csv $out/sizes.csv \
  --chart $out/sizes.png drop:rigid drop:deformable
note costs/sizes.csv

run $bench/lazyccd_phase_costs rest --seconds 5 --csv $out/phases.csv
/usr/bin/python3 examples/bench/costs/phase_chart.py $out/phases.csv $out/phases.png
note costs/phases.csv
run $bench/lazyccd_phase_costs islands >$work/islands
{ echo "world,part,resting,in an impact,both,both / sum" && cells $work/islands; } >$out/islands.csv
note costs/islands.csv
run $bench/lazyccd_phase_costs spawn >$work/spawn
{ echo "world,bodies,Bullet ms,Bullet ms with a new body,LazyCCD ms,LazyCCD ms with a new body" &&
  cells $work/spawn; } >$out/spawn.csv
note costs/spawn.csv

run $bench/lazyccd_sleeper_costs --csv $out/sleepers.csv
/usr/bin/python3 examples/bench/costs/sleeper_chart.py $out/sleepers.csv $out/sleepers.png
note costs/sleepers.csv

counts=1 && for ((n = 2; n <= $(nproc); n *= 2)); do counts+=,$n; done
run /usr/bin/python3 examples/bench/scaling.py $programs/lazyccd --threads $counts --steps 100 --csv $out/threads.csv \
  --chart $out/threads.png
note costs/threads.csv
run /usr/bin/python3 examples/bench/scaling.py $programs/lazyccd --threads "1,2,$(nproc),auto" --steps 100 --without-bullet \
  --csv $out/threads_auto.csv {cloth-on-cloth,drop,fold,n-body}:rigid:1 \
  {cloth-on-cloth,drop,twenty-cloths}:deformable:1 cloth-on-cloth:rigid:4
note costs/threads_auto.csv

run $programs/lazyccd study --backend cpu --model cloud-64 cloud-256 cloud-1024 funnel cloth-ball --first 44 --last 60 \
  --warm-up 1 --repeat 3 --threads 2 --strategy lazy_stealing --volume box dop18 oriented_box --front auto on \
  --culling default none non_penetration+normal_cones+orphan_sets --csv $out/settings.csv
/usr/bin/python3 examples/bench/costs/settings_chart.py $out/settings.csv $out/settings.png
note costs/settings.csv
