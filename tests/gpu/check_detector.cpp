// Compares the CUDA backend with the CPU backend: the same contacts in every field, and the same
// hash. It uses no test framework, so that it runs on a machine that has only the driver installed.
//
//   check_detector [--repeat N] [--small] [--culling] [START.ply END.ply]...
//
// --small: small scenes, for the sanitizers. --culling: checks volumes and culling only; if files
// are given, on these files only.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "device_probe.h"
#include "io/ply.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "report.h"

namespace {

using namespace lazyccd;

bool equal(const Contact& a, const Contact& b) { return std::memcmp(&a, &b, sizeof(Contact)) == 0; }

struct Scene {
  std::string name;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<std::int32_t> body_of_vertex;
  std::vector<float> inverse_mass, self_separation;
  std::vector<Body> bodies;
  std::vector<BodyPair> disabled;
  std::vector<std::vector<std::array<double, 3>>> frames;  // at least two

  Topology topology() const {
    Topology t;
    t.vertex_count = frames[0].size();
    t.faces = faces;
    t.edges = edges;
    t.body_of_vertex = body_of_vertex;
    t.inverse_mass = inverse_mass;
    t.self_separation = self_separation;
    t.bodies = bodies;
    t.disabled_pairs = disabled;
    return t;
  }
  Positions positions(std::size_t frame) const {
    return {frames[frame].data()->data(), frames[frame].size()};
  }
};

// Sheets of n x n quads that tumble through each other, with ropes between them and some pinned
// vertices.
Scene tumbling_sheets(int sheets, int n, int frames, double offset, bool in_float) {
  Scene scene;
  scene.name = std::to_string(sheets) + " sheets of " + std::to_string(n) + "x" +
               std::to_string(n) + " quads" + (offset != 0 ? ", far away" : "") +
               (in_float ? ", float" : ", double");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  struct Motion {
    double centre[3], axis[3], speed[3], phase;
  };
  std::vector<Motion> motions;
  for (int s = 0; s < sheets; ++s) {
    Motion m{};
    for (int k = 0; k < 3; ++k) {
      m.centre[k] = 0.4 * uniform(random);
      m.axis[k] = uniform(random);
      m.speed[k] = 0.05 * uniform(random);
    }
    m.phase = 3 * uniform(random);
    motions.push_back(m);
    Body body;
    body.self_collision = s % 3 != 0;
    body.group = s % 4 == 3 ? 2 : 1;
    body.mask = s % 5 == 4 ? 1 : 3;
    scene.bodies.push_back(body);
    const std::int32_t base = s * (n + 1) * (n + 1);
    for (int y = 0; y <= n; ++y) {
      for (int x = 0; x <= n; ++x) {
        scene.body_of_vertex.push_back(s);
        scene.inverse_mass.push_back(s % 7 == 6 || (y == 0 && s % 2) ? 0.0f : 1.0f);
        const std::int32_t v = base + y * (n + 1) + x;
        if (x < n && y < n && s % 6 != 5) {
          scene.faces.push_back({v, v + 1, v + n + 1});
          scene.faces.push_back({v + 1, v + n + 2, v + n + 1});
        } else if (x < n) {
          scene.edges.push_back({v, v + 1});  // a body of ropes
        }
      }
    }
  }
  if (sheets > 2) scene.disabled.push_back({2, 0});
  for (int f = 0; f < frames; ++f) {
    std::vector<std::array<double, 3>> frame;
    for (int s = 0; s < sheets; ++s) {
      const Motion& m = motions[s];
      const double angle = m.phase + 0.1 * f, c = std::cos(angle), d = std::sin(angle);
      for (int y = 0; y <= n; ++y) {
        for (int x = 0; x <= n; ++x) {
          const double u = static_cast<double>(x) / n - 0.5, v = static_cast<double>(y) / n - 0.5;
          const double w = 0.1 * std::sin(7 * u + 5 * v + f);
          std::array<double, 3> p{c * u - d * w, v * (0.5 + m.axis[0]) + 0.3 * w, d * u + c * w};
          for (int k = 0; k < 3; ++k) {
            p[k] += m.centre[k] + f * m.speed[k] + offset;
            if (in_float) p[k] = static_cast<float>(p[k]);
          }
          frame.push_back(p);
        }
      }
    }
    scene.frames.push_back(frame);
  }
  return scene;
}

// Two sheets of n x n quads that wave gently and pass through each other. Parts of them are flat
// during a step, and there are many contacts.
Scene calm_sheets(int n, int frames, bool in_float) {
  Scene scene;
  scene.name = "2 calm sheets of " + std::to_string(n) + "x" + std::to_string(n) + " quads" +
               (in_float ? ", float" : ", double");
  for (std::int32_t s = 0; s < 2; ++s) {
    Body body;
    body.self_collision = true;
    scene.bodies.push_back(body);
    const std::int32_t base = s * (n + 1) * (n + 1);
    for (int y = 0; y <= n; ++y) {
      for (int x = 0; x <= n; ++x) {
        scene.body_of_vertex.push_back(s);
        scene.inverse_mass.push_back(1);
        const std::int32_t v = base + y * (n + 1) + x;
        if (x == n || y == n) continue;
        scene.faces.push_back({v, v + 1, v + n + 1});
        scene.faces.push_back({v + 1, v + n + 2, v + n + 1});
      }
    }
  }
  for (int f = 0; f < frames; ++f) {
    std::vector<std::array<double, 3>> frame;
    for (int s = 0; s < 2; ++s) {
      for (int y = 0; y <= n; ++y) {
        for (int x = 0; x <= n; ++x) {
          const double u = static_cast<double>(x) / n, v = static_cast<double>(y) / n;
          const double height = 0.02 * std::sin(7 * u + 5 * v + 0.3 * f + s);
          std::array<double, 3> p{u + 0.1 * s * v, v, height + s * 0.02 * (1.5 - f)};
          if (in_float)
            for (double& c : p) c = static_cast<float>(c);
          frame.push_back(p);
        }
      }
    }
    scene.frames.push_back(frame);
  }
  return scene;
}

// Triangles, each a body, with corners on a lattice. Their features meet in corners, along edges
// and in planes, often at several times at once, so many pairs need exact arithmetic.
Scene lattice_triangles(int count, int side, int frames, double spacing, bool in_float) {
  Scene scene;
  scene.name = std::to_string(count) + " triangles on a lattice of " + std::to_string(side) +
               (in_float ? ", float" : ", double");
  std::mt19937 random(11);
  const auto corner = [&]() -> std::array<double, 3> {
    std::array<double, 3> p;
    for (double& c : p) {
      c = spacing * static_cast<double>(random() % static_cast<unsigned>(side));
      if (in_float) c = static_cast<float>(c);
    }
    return p;
  };
  for (std::int32_t i = 0; i < count; ++i) {
    scene.bodies.emplace_back();
    scene.body_of_vertex.insert(scene.body_of_vertex.end(), 3, i);
    scene.inverse_mass.insert(scene.inverse_mass.end(), 3, 1.0f);
    scene.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  for (int f = 0; f < frames; ++f) {
    std::vector<std::array<double, 3>> frame;
    for (int v = 0; v < 3 * count; ++v) frame.push_back(corner());
    scene.frames.push_back(frame);
  }
  return scene;
}

constexpr std::int64_t kMostBytes =
    300'000'000;  // device memory; enough for each scene here, also Cloth/Ball

// Leaves out some edges, vertices and pairs of bodies.
void leave_out_some(Detector& detector, const Scene& scene) {
  const Topology topology = scene.topology();
  std::vector<char> edges(detector.edges().size()), vertices(topology.vertex_count);
  std::vector<char> resting(std::max<std::size_t>(scene.bodies.size(), 1));
  for (std::size_t i = 0; i < edges.size(); ++i) edges[i] = i % 3 == 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i] = i % 4 == 0;
  for (std::size_t i = 0; i < resting.size(); ++i) resting[i] = i % 3 != 1 && resting.size() > 2;
  detector.leave_out(edges, vertices);
  detector.set_resting(resting);
}

// The contacts that the CPU finds in each step.
struct Truth {
  struct Step {
    std::vector<Contact> contacts;
    std::uint64_t hash;
    // With a separation:
    std::vector<double> near_distances;
    std::int64_t near_pairs = 0;
    std::uint64_t rechecked_hash = 0;
  };
  std::vector<Step> steps;
  long total = 0;
  bool leaves_out = false;

  Truth(const Scene& scene, double separation, bool reduce_contacts = false,
        bool leaves_out_some = false)
      : leaves_out(leaves_out_some) {
    DetectorOptions options;
    options.backend = Backend::cpu;
    options.separation = separation;
    options.reduce_contacts = reduce_contacts;
    Detector cpu(options);
    cpu.set_topology(scene.topology());
    if (leaves_out) leave_out_some(cpu, scene);
    for (std::size_t f = 0; f + 1 < scene.frames.size(); ++f) {
      const Span<const Contact> found = cpu.detect(scene.positions(f), scene.positions(f + 1));
      Step step = {{found.begin(), found.end()}, cpu.stats().hash, {}};
      total += static_cast<long>(found.size());
      if (separation > 0) {
        const Span<const double> distances = cpu.near_distances();
        step.near_distances.assign(distances.begin(), distances.end());
        step.near_pairs = cpu.stats().near_pairs;
        cpu.recheck_near_pairs(scene.positions(f), scene.positions(f + 1));
        step.rechecked_hash = cpu.stats().hash;
      }
      steps.push_back(std::move(step));
    }
  }
};

// Compares what a detection with a separation says besides its contacts. Ends with a re-check.
bool compare_near(const Scene& scene, std::size_t frame, const Truth::Step& wanted, Detector& gpu,
                  std::string& why) {
  const Span<const double> distances = gpu.near_distances();
  if (!std::equal(distances.begin(), distances.end(), wanted.near_distances.begin(),
                  wanted.near_distances.end())) {
    why = "frame " + std::to_string(frame) + ": other near distances";
    return false;
  }
  if (gpu.stats().near_pairs != wanted.near_pairs) {
    why = "frame " + std::to_string(frame) + ": " + std::to_string(gpu.stats().near_pairs) +
          " near pairs in place of " + std::to_string(wanted.near_pairs);
    return false;
  }
  gpu.recheck_near_pairs(scene.positions(frame), scene.positions(frame + 1));
  if (gpu.stats().hash != wanted.rechecked_hash) {
    why = "frame " + std::to_string(frame) + ": another re-check";
    return false;
  }
  return true;
}

// Pairs culled by each method, summed over all runs. Each method must have culled some.
struct Culled {
  std::int64_t by_volume[3] = {}, culled_by_normal_cone = 0, orphans = 0, filtered_noncoplanar = 0;
} culled;

// Adds the counts of a step. Returns false if a method that is off has culled something.
bool count_culled(const DetectorOptions& options, const Stats& s) {
  culled.by_volume[static_cast<int>(options.algorithm.volume)] += s.culled_by_volume;
  culled.culled_by_normal_cone += s.culled_by_normal_cone;
  culled.orphans += s.orphan_tests;
  culled.filtered_noncoplanar += s.filtered_noncoplanar;
  const bool thick = options.separation > 0;
  return (options.algorithm.volume != Volume::box || s.culled_by_volume == 0) &&
         ((options.algorithm.culling.normal_cones && !thick) || s.culled_by_normal_cone == 0) &&
         ((options.algorithm.culling.orphan_sets && !thick) || s.orphan_tests == 0) &&
         (options.algorithm.culling.non_penetration || s.filtered_noncoplanar == 0);
}

// Runs the steps of a scene on the device. On a difference returns false and sets `why`.
bool compare(const Scene& scene, const Truth& truth, DetectorOptions options, int repeat,
             std::string& why) {
  options.backend = Backend::cuda;
  Detector gpu(options);
  gpu.set_topology(scene.topology());
  if (truth.leaves_out) leave_out_some(gpu, scene);
  for (std::size_t f = 0; f < truth.steps.size(); ++f) {
    const Truth::Step& wanted = truth.steps[f];
    for (int r = 0; r < repeat; ++r) {
      const Span<const Contact> found = gpu.detect(scene.positions(f), scene.positions(f + 1));
      if (gpu.stats().backend != "cuda") {
        why = gpu.status();
        return false;
      }
      if (gpu.stats().peak_bytes > kMostBytes) {
        why = std::to_string(gpu.stats().peak_bytes) + " bytes on the device";
        return false;
      }
      if (!count_culled(options, gpu.stats())) {
        why = "something was culled in a way that was not asked for";
        return false;
      }
      bool same = found.size() == wanted.contacts.size() && gpu.stats().hash == wanted.hash &&
                  contact_hash(found) == wanted.hash;
      std::size_t first = 0;
      for (; same && first < found.size(); ++first)
        same = equal(found[first], wanted.contacts[first]);
      if (!same) {
        why = "frame " + std::to_string(f) + " repetition " + std::to_string(r) + ": " +
              std::to_string(found.size()) + " of " + std::to_string(wanted.contacts.size()) +
              " contacts, first difference at " + std::to_string(first);
        return false;
      }
      if (options.separation > 0 && !compare_near(scene, f, wanted, gpu, why)) return false;
    }
  }
  return true;
}

// A separation of a tenth of the mean edge length.
double thin_separation(const Scene& scene) {
  double sum = 0;
  for (const Face& f : scene.faces) {
    const auto &a = scene.frames[0][f[0]], &b = scene.frames[0][f[1]];
    sum += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  }
  return 0.1 * sum / static_cast<double>(scene.faces.size());
}

// The scene with separations within its bodies that differ between vertices: up to 1.2 times
// `separation`.
Scene with_self_separation(Scene scene, double separation) {
  for (std::size_t v = 0; v < scene.frames[0].size(); ++v)
    scene.self_separation.push_back(
        static_cast<float>(0.1 * separation * static_cast<double>(3 + v * 7 % 10)));
  return scene;
}

void check(const Scene& scene, const Truth& truth, const DetectorOptions& options, int repeat,
           const std::string& setting) {
  std::string why;
  bool good = false;
  try {
    good = compare(scene, truth, options, repeat, why);
  } catch (const Error& error) {
    why = error.what();
  }
  report(good, scene.name + ", " + setting + ": " +
                   (good ? std::to_string(truth.total) + " contacts" : why));
}

std::string describe(const DetectorOptions& options) {
  const Culling& c = options.algorithm.culling;
  return std::string(name(options.algorithm.strategy)) + ", " + name(options.algorithm.volume) +
         (c.non_penetration ? ", filter" : "") + (c.normal_cones ? ", cones" : "") +
         (c.orphan_sets ? ", orphans" : "");
}

// Checks every volume with every strategy and every culling of the list.
void check_culling(const Scene& scene, const Truth& truth, double separation,
                   const std::vector<Culling>& list) {
  for (const Strategy strategy : kStrategies) {
    for (const Volume volume : kVolumes) {
      for (const Culling& culling : list) {
        DetectorOptions options;
        options.algorithm.strategy = strategy;
        options.algorithm.volume = volume;
        options.algorithm.culling = culling;
        options.separation = separation;
        check(scene, truth, options, 2,  // the second run starts from a front
              describe(options) + (separation > 0 ? ", with a separation" : ""));
      }
    }
  }
}

std::vector<Culling> all_culling() {
  std::vector<Culling> all;
  for (int bits = 0; bits < 8; ++bits)
    all.push_back({(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0});
  return all;
}

void report_culled() {
  const auto share = [](std::int64_t count, const std::string& what) {
    report(count > 0, what + ": " + std::to_string(count) + " in all");
  };
  share(culled.by_volume[static_cast<int>(Volume::dop18)], "pairs of nodes that dop18 culled");
  share(culled.by_volume[static_cast<int>(Volume::oriented_box)],
        "pairs of nodes that oriented_box culled");
  share(culled.culled_by_normal_cone, "nodes that normal cones kept closed");
  share(culled.orphans, "candidates from the orphan sets");
  share(culled.filtered_noncoplanar, "candidates that the non-penetration filter ruled out");
}

// Prints the median time of a detection, and how many queries needed exact arithmetic.
void time_exact(const Scene& scene) {
  constexpr int steps = 21;
  DetectorOptions options;
  options.backend = Backend::cuda;
  Detector detector(options);
  detector.set_topology(scene.topology());
  std::vector<double> device, whole;
  for (int i = 0; i < steps; ++i) {
    detector.detect(scene.positions(0), scene.positions(1));
    device.push_back(detector.stats().ms_device);
    whole.push_back(detector.stats().ms_total);
  }
  const auto median = [](std::vector<double> times) {
    std::sort(times.begin(), times.end());
    return times[times.size() / 2];
  };
  const Stats& stats = detector.stats();
  std::printf(
      "TIME  %s: %lld contacts, %lld queries in double, %lld exact: device %.3f ms, whole %.3f "
      "ms\n",
      scene.name.c_str(), static_cast<long long>(stats.contacts_vf + stats.contacts_ee),
      static_cast<long long>(stats.double_precision_tests),
      static_cast<long long>(stats.exact_tests), median(device), median(whole));
}

}  // namespace

int main(int argc, char** argv) {
  lazyccd::register_research();
  int repeat = 3;
  bool small = false, only_culling = false;
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--repeat" && i + 1 < argc) {
      repeat = std::atoi(argv[++i]);
    } else if (std::string(argv[i]) == "--small") {
      small = true;
    } else if (std::string(argv[i]) == "--culling") {
      only_culling = true;
    } else {
      files.push_back(argv[i]);
    }
  }

  if (skips_without_cuda()) return kSkipped;
  if (small) {
    for (const bool graph : {true, false}) {
      if (only_culling) break;
      const Scene scene = tumbling_sheets(9, 8, 3, 0, graph);
      const Truth truth(scene, 0), thick(scene, 0.01);
      for (const Strategy strategy : kStrategies) {
        DetectorOptions options;
        options.algorithm.strategy = strategy;
        options.algorithm.tuning.graph = graph;
        check(scene, truth, options, 1, name(strategy));
        if (!graph) continue;
        options.separation = 0.01;
        check(scene, thick, options, 1, std::string(name(strategy)) + ", separation");
      }
    }
    for (const Scene& scene : {calm_sheets(12, 3, true), tumbling_sheets(9, 8, 3, 0, false)})
      check_culling(scene, Truth(scene, 0), 0, {{true, true, true}});
    report_culled();
    std::printf("%d failed\n", failures);
    return failures == 0 ? 0 : 1;
  }

  std::vector<Scene> scenes;
  scenes.push_back(tumbling_sheets(1, 1, 4, 0, true));
  scenes.push_back(tumbling_sheets(2, 3, 6, 0, true));
  scenes.push_back(tumbling_sheets(9, 12, 12, 0, true));
  scenes.push_back(tumbling_sheets(9, 12, 12, 0, false));
  scenes.push_back(tumbling_sheets(12, 20, 6, 1000, true));
  scenes.push_back(tumbling_sheets(40, 20, 4, 0, false));
  for (const bool in_float : {true, false}) {
    scenes.push_back(lattice_triangles(60, 4, 4, 1, in_float));
    scenes.push_back(lattice_triangles(150, 6, 4, 0.1, in_float));
  }
  const std::size_t ours = scenes.size();
  for (std::size_t i = 0; i + 1 < files.size(); i += 2) {
    Scene scene;
    const io::Mesh start = io::read_ply(files[i]), end = io::read_ply(files[i + 1]);
    scene.name = files[i];
    scene.faces = start.faces;
    scene.frames = {start.vertices, end.vertices};
    scenes.push_back(scene);
  }

  for (const Scene& scene : scenes) {
    if (only_culling) break;
    const double separation = thin_separation(scene);
    const Truth truth(scene, 0), thick(scene, separation);
    const Scene limited = with_self_separation(scene, separation);
    const Truth thick_limited(limited, separation), reduced(limited, separation, true),
        fewer(limited, separation, true, true);
    for (const Strategy strategy : kStrategies) {
      DetectorOptions options;
      options.algorithm.strategy = strategy;
      const std::string called = name(strategy);
      check(scene, truth, options, repeat, called);
      options.algorithm.front = FrontUse::off;
      check(scene, truth, options, repeat, called + ", no front");
      options.algorithm.front = FrontUse::automatic;
      options.algorithm.tuning.graph = false;
      check(scene, truth, options, 1, called + ", no graph");
      options.algorithm.tuning.graph = true;
      options.algorithm.tuning.capacity_hint = 1;
      check(scene, truth, options, 1, called + ", capacity 1");
      options.algorithm.tuning.capacity_hint = 0;
      options.algorithm.rebuild_every_step = true;
      check(scene, truth, options, 1, called + ", rebuilt each step");
      options.algorithm.rebuild_every_step = false;
      options.separation = separation;
      check(scene, thick, options, 1, called + ", with a separation");
      check(limited, thick_limited, options, 1, called + ", with separations within the bodies");
      options.reduce_contacts = true;
      check(limited, reduced, options, 1, called + ", with reduced contacts");
      check(limited, fewer, options, repeat, called + ", with some left out");
      options.algorithm.tuning.capacity_hint = 1;
      check(limited, reduced, options, 1, called + ", with reduced contacts, capacity 1");
      options.algorithm.tuning.capacity_hint = 0;
      options.reduce_contacts = false;
      options.separation = 0;
      for (const int block : {32, 64, 128, 256}) {
        options.algorithm.tuning.block_size = block;
        options.algorithm.tuning.blocks = block == 32 ? 3 : 0;
        options.algorithm.tuning.chunk = block == 64 ? 32 : 0;
        check(scene, truth, options, 1, called + ", blocks of " + std::to_string(block));
      }
    }
  }
  const bool only_files = only_culling && !files.empty();
  for (const bool in_float : {true, false}) {
    if (only_files) break;
    for (const Scene& scene :
         {calm_sheets(24, 5, in_float), tumbling_sheets(9, 12, 5, 0, in_float)})
      check_culling(scene, Truth(scene, 0), 0, all_culling());
  }
  for (std::size_t i = only_files ? ours : 0; i < scenes.size(); ++i) {
    check_culling(scenes[i], Truth(scenes[i], 0), 0, {{true, true, true}});
    const double separation = thin_separation(scenes[i]);
    check_culling(scenes[i], Truth(scenes[i], separation), separation, {{}});
  }
  report_culled();
  for (const int count : {50, 100, 200, 400}) time_exact(lattice_triangles(count, 8, 2, 1, true));
  std::printf("%d failed\n", failures);
  return failures == 0 ? 0 : 1;
}
