// Many worlds on the device: the same contacts as on the CPU; the same contacts of a world alone
// and among all; the time of a detection against the same bodies side by side in one world. It
// uses no test framework, so that it runs on a machine that has only the driver installed.
//
//   check_worlds [--worlds N] [--bodies N] [--repeat N] [--cpu]
//
// --worlds: the largest number of worlds that is timed (default 4096). --bodies: of each world, 162
// faces each (default 10). --cpu: times the CPU backend instead, and needs no device.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "device_probe.h"
#include "lazyccd/detector.h"
#include "models/worlds.h"
#include "report.h"

namespace {

using namespace lazyccd;
using models::Layout;
using models::WorldsScene;

bool same(Span<const Contact> a, Span<const Contact> b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Contact)) == 0);
}

// All but the numbers of bodies, vertices and primitives.
bool same_geometry(Span<const Contact> a, Span<const Contact> b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const Contact& x, const Contact& y) {
           return x.kind == y.kind && x.toi == y.toi && x.u == y.u && x.v == y.v &&
                  x.normal == y.normal;
         });
}

DetectorOptions on(Backend backend) {
  DetectorOptions options;
  options.backend = backend;
  return options;
}

void check(std::int32_t worlds, std::int32_t bodies, DetectorOptions options,
           const std::string& what) {
  const WorldsScene scene(worlds, bodies, Layout::one_place);
  DetectorOptions plain = on(Backend::cpu);
  plain.separation = options.separation;
  Detector cpu(plain), gpu(options);
  cpu.set_topology(scene.topology());
  gpu.set_topology(scene.topology());
  bool good = true, hashes = true;
  for (int step = 0; step < 3; ++step) {
    const Positions a = scene.positions(step % 2), b = scene.positions(1 - step % 2);
    good = good && same(cpu.detect(a, b), gpu.detect(a, b)) && gpu.status() == "cuda" &&
           cpu.stats().hash == gpu.stats().hash;
    for (std::int32_t w = -1; w < worlds; w += 1 + worlds / 97)
      hashes = hashes && cpu.hash_of_world(w) == gpu.hash_of_world(w) &&
               same(cpu.contacts_of_world(w), gpu.contacts_of_world(w));
  }
  report(good && hashes, std::to_string(worlds) + " worlds of " + std::to_string(bodies) +
                             " bodies, " + what + ": " +
                             std::to_string(gpu.world_offsets()[gpu.world_offsets().size() - 1]) +
                             " contacts" + (good ? "" : "; " + gpu.status()));
}

void check_alone(std::int32_t worlds, std::int32_t bodies) {
  const WorldsScene scene(worlds, bodies, Layout::one_place);
  Detector all(on(Backend::cuda));
  all.set_topology(scene.topology());
  all.detect(scene.positions(0), scene.positions(1));
  bool good = true;
  int checked = 0;
  for (std::int32_t w = 0; w < worlds; w += 1 + worlds / 40, ++checked) {
    const WorldsScene one(1, bodies, Layout::one_place, w);
    Detector alone(on(w % 2 == 0 ? Backend::cuda : Backend::cpu));
    alone.set_topology(one.topology());
    good =
        good &&
        same_geometry(alone.detect(one.positions(0), one.positions(1)), all.contacts_of_world(w)) &&
        alone.stats().hash == all.hash_of_world(w);
  }
  report(good, std::to_string(checked) + " of " + std::to_string(worlds) +
                   " worlds: the same bits alone and among all");
}

struct Times {
  double device, whole, build;
  std::int64_t faces, contacts, tests;
  std::uint64_t hash;
};

Times time(const WorldsScene& scene, Backend backend, int repeat) {
  Detector detector(on(backend));
  detector.set_topology(scene.topology());
  std::vector<double> device, whole;
  Times times{};
  for (int step = 0; step <= repeat + 2; ++step) {
    detector.detect(scene.positions(step % 2), scene.positions(1 - step % 2));
    const Stats& s = detector.stats();
    if (step == 0) {
      times.build = s.ms_total;
      times.hash = s.hash;
      times.contacts = s.contacts_vf + s.contacts_ee;
    }
    if (step < 2) continue;  // the first steps build and allocate
    device.push_back(s.ms_device);
    whole.push_back(s.ms_total);
  }
  std::sort(device.begin(), device.end());
  std::sort(whole.begin(), whole.end());
  times.device = device[device.size() / 2];
  times.whole = whole[whole.size() / 2];
  times.faces = detector.stats().faces;
  times.tests = detector.stats().tree_tests;
  return times;
}

}  // namespace

int main(int argc, char** argv) {
  lazyccd::register_research();
  int most = 4096, bodies = 10, repeat = 15;
  Backend backend = Backend::cuda;
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (option == "--cpu") backend = Backend::cpu;
    if (i + 1 == argc) break;
    if (option == "--worlds") most = std::atoi(argv[i + 1]);
    if (option == "--bodies") bodies = std::atoi(argv[i + 1]);
    if (option == "--repeat") repeat = std::atoi(argv[i + 1]);
  }
  if (backend == Backend::cuda) {
    if (skips_without_cuda()) return kSkipped;
    for (const Strategy strategy : kStrategies) {
      DetectorOptions options = on(backend);
      options.algorithm.strategy = strategy;
      check(40, 5, options, name(strategy));
    }
    DetectorOptions options = on(backend);
    options.algorithm.rebuild_every_step = true;
    check(40, 5, options, "rebuilt each step");
    options.algorithm.rebuild_every_step = false;
    options.algorithm.culling.normal_cones = true;
    check(40, 5, options, "normal cones");
    options.algorithm.culling.normal_cones = false;
    options.separation = 0.002;
    check(40, 5, options, "with a separation");
    options.separation = 0;
    options.algorithm.tuning.capacity_hint = 1;
    check(40, 5, options, "capacity 1");
    check(1, 3, on(backend), "one world");
    check(16384, 1, on(backend), "many small worlds");
    check(std::min(most, 2048), bodies, on(backend), "keys of two words");
    check_alone(std::min(most, 2048), bodies);
  }
  std::printf("%7s %10s %10s %12s | %9s %9s | %9s %9s %5s\n", "worlds", "faces", "contacts",
              "node tests", "device ms", "whole ms", "one: dev", "whole", "ratio");
  for (std::int64_t worlds = std::min(most, 4); worlds <= most; worlds *= 4) {
    const auto count = static_cast<std::int32_t>(worlds);
    const Times many = time(WorldsScene(count, bodies, Layout::one_place), backend, repeat);
    const Times one = time(WorldsScene(count, bodies, Layout::side_by_side), backend, repeat);
    std::printf("%7d %10lld %10lld %12lld | %9.3f %9.3f | %9.3f %9.3f %5.2f\n", count,
                static_cast<long long>(many.faces), static_cast<long long>(many.contacts),
                static_cast<long long>(many.tests), many.device, many.whole, one.device, one.whole,
                many.whole / one.whole);
    std::fflush(stdout);
  }
  std::printf("%d failed\n", failures);
  return failures == 0 ? 0 : 1;
}
