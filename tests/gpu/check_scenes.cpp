// Steps scenes of the library with Bullet and detects contacts with both backends in every step.
// The contacts must be the same in every field, and the hash too. The motion of a step is
// lengthened, so that pairs that the response has kept apart are in contact too.
//
//   check_scenes [--steps N] [SCENE]...     (default: all scenes)
//   check_scenes --list
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "device_probe.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "scenes/meshes/surface.h"
#include "scenes/scene.h"

namespace {

using namespace lazyccd;

constexpr double kLengthening = 3;  // factor of the motion of a step

struct Setting {
  std::string name;
  DetectorOptions options;
  bool has_separation = false;
  bool leaves_out = false;  ///< every third edge and every fourth vertex
  bool rests = false;       ///< all bodies but every third rest
};

std::vector<Setting> settings() {
  std::vector<Setting> all;
  for (const Strategy strategy : kStrategies) {
    for (const int block : {0, 32, 256}) {
      DetectorOptions options;
      options.backend = Backend::cuda;
      options.algorithm.strategy = strategy;
      options.algorithm.tuning.block_size = block;
      options.algorithm.tuning.delay_ns = block == 32 ? 500 : 0;
      all.push_back(
          {std::string(name(strategy)) + ", blocks of " + std::to_string(block), options});
    }
  }
  all.push_back(all.front());
  all.back().name += ", with a separation";
  all.back().has_separation = true;
  all.push_back(all.back());
  all.back().name += ", without some edges and vertices";
  all.back().leaves_out = true;
  all.push_back(all[all.size() - 2]);
  all.back().name += ", with resting bodies";
  all.back().rests = true;
  return all;
}

bool equal(Span<const Contact> a, Span<const Contact> b) {
  return a.size() == b.size() &&
         (a.size() == 0 || std::memcmp(a.data(), b.data(), a.size() * sizeof(Contact)) == 0);
}

// A detector on the device and one on the CPU with the same options.
struct Pair {
  Pair(const Setting& setting, const Topology& topology, double separation)
      : name(setting.name),
        has_separation(setting.has_separation),
        gpu(with(setting, Backend::cuda, separation)),
        cpu(with(setting, Backend::cpu, separation)) {
    for (Detector* const detector : {&gpu, &cpu}) {
      detector->set_topology(topology);
      if (setting.leaves_out) leave_out(*detector, topology.vertex_count);
      if (setting.rests) let_rest(*detector, topology.bodies.size());
    }
  }
  static void let_rest(Detector& detector, std::size_t body_count) {
    std::vector<char> resting(body_count);
    for (std::size_t b = 0; b < body_count; ++b) resting[b] = b % 3 != 2;
    detector.set_resting(resting);
  }
  static void leave_out(Detector& detector, std::size_t vertex_count) {
    std::vector<char> edges(detector.edges().size()), vertices(vertex_count);
    for (std::size_t e = 0; e < edges.size(); ++e) edges[e] = e % 3 == 0;
    for (std::size_t v = 0; v < vertices.size(); ++v) vertices[v] = v % 4 == 0;
    detector.leave_out(edges, vertices);
  }
  static DetectorOptions with(const Setting& setting, Backend backend, double separation) {
    DetectorOptions options = setting.options;
    options.backend = backend;
    options.separation = separation;
    return options;
  }
  std::string name;
  bool has_separation;
  Detector gpu, cpu;
};

// Returns the number of contacts over all steps, or -1 on a difference.
long check(const scenes::SceneInfo& info, unsigned seed, int steps) {
  scenes::Parameters parameters;
  parameters.seed = seed;
  parameters.size = 0.7;
  parameters.lazyccd.detector.backend = Backend::cpu;
  scenes::Scene scene = scenes::set_up(info, parameters);
  const scenes::Surface surface = scenes::read_surface(*scene.world);
  std::vector<std::unique_ptr<Pair>> pairs;
  for (const Setting& setting : settings()) {
    pairs.push_back(std::make_unique<Pair>(setting, surface.topology(),
                                           setting.has_separation ? 0.2 * info.margin : 0));
  }
  long total = 0;
  std::vector<btScalar> last = scenes::read_positions(*scene.world);
  for (int step = 0; step < steps; ++step) {
    scene.world->step();
    const std::vector<btScalar> now = scenes::read_positions(*scene.world);
    std::vector<btScalar> end(now);
    for (std::size_t i = 0; i < end.size(); ++i)
      end[i] = static_cast<btScalar>(last[i] + kLengthening * (now[i] - last[i]));
    const Positions from(last.data(), last.size() / 3), to(end.data(), end.size() / 3);
    Span<const Contact> touching;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      Pair& pair = *pairs[i];
      // Without a separation all settings have the same contacts, so the CPU finds them once.
      Detector& cpu = pair.has_separation ? pair.cpu : pairs[0]->cpu;
      const Span<const Contact> wanted =
          i == 0 || pair.has_separation ? cpu.detect(from, to) : touching;
      if (i == 0) touching = wanted;
      const Span<const Contact> found = pair.gpu.detect(from, to);
      if (pair.gpu.stats().backend == "cuda" && equal(found, wanted) &&
          pair.gpu.stats().hash == cpu.stats().hash) {
        total += static_cast<long>(found.size());
        continue;
      }
      std::printf("FAIL  %s, seed %u, step %d, %s: %zu of %zu contacts, %s\n", info.name.c_str(),
                  seed, step, pair.name.c_str(), found.size(), wanted.size(),
                  pair.gpu.status().c_str());
      return -1;
    }
    last = now;
  }
  return total;
}

}  // namespace

int main(int argc, char** argv) {
  lazyccd::register_research();
  int steps = 200;
  std::vector<std::string> names;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--steps" && i + 1 < argc) {
      steps = std::atoi(argv[++i]);
    } else if (std::string(argv[i]) == "--list") {
      for (const scenes::SceneInfo& info : scenes::all_scenes())
        std::printf("%s\n", info.name.c_str());
      return 0;
    } else {
      names.emplace_back(argv[i]);
    }
  }
  if (skips_without_cuda()) return kSkipped;
  if (names.empty())
    for (const scenes::SceneInfo& info : scenes::all_scenes()) names.push_back(info.name);
  int failures = 0;
  try {
    for (const std::string& name : names) {
      const scenes::SceneInfo* info = scenes::find_scene(name);
      for (const unsigned random_seed : {1u, 2u}) {
        const long contacts = info ? check(*info, random_seed, steps) : -1;
        failures += contacts < 0;
        if (contacts >= 0)
          std::printf("PASS  %s, seed %u: %d steps, %ld contacts\n", name.c_str(), random_seed,
                      steps, contacts);
        std::fflush(stdout);
      }
    }
  } catch (const Error& error) {
    std::printf("FAIL  %s\n", error.what());
    ++failures;
  }
  std::printf("%d failed\n", failures);
  return failures == 0 ? 0 : 1;
}
