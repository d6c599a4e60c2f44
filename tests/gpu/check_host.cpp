// Detection from positions on the host to contacts on the host: always the contacts and the hash of
// the CPU. It uses no test framework, so that it runs on a machine that has only the driver
// installed.
//
//   check_host [--small]     # --small: small scenes, for the sanitizers
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <limits>
#include <string>
#include <vector>

#include "device_probe.h"
#include "frames.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "report.h"

namespace {

using namespace lazyccd;

// Some fields of the contacts, in arrays of their own.
void check_columns(const Frames& frames) {
  const std::vector<Found> truth = truth_of(frames);
  bool good = true;
  for (const std::uint32_t hint : {0u, 1u})
    for (const std::uint32_t fields : {127u, 120u, 64u, 9u, 34u, 0u}) {
      DetectorOptions options = on(Backend::cuda);
      options.algorithm.tuning.capacity_hint = hint;
      Detector detector(options);
      detector.set_topology(frames.topology());
      for (std::size_t s = 0; s < frames.steps(); ++s) {
        const ContactColumns c =
            detector.detect_columns(frames.positions(s), frames.positions(s + 1), fields);
        const std::vector<Contact>& all = truth[s].contacts;
        good = good && c.count == all.size() && detector.stats().hash == truth[s].hash &&
               detector.stats().backend == "cuda";
        for (std::size_t i = 0; good && i < all.size(); ++i)
          good = (c.kind.empty() || c.kind[i] == all[i].kind) &&
                 (c.bodies.empty() || c.bodies[i][1] == all[i].body_b) &&
                 (c.primitives.empty() || c.primitives[i][1] == all[i].primitive_b) &&
                 (c.vertices.empty() || c.vertices[i] == all[i].vertices) &&
                 (c.point.empty() || c.point[i][1] == all[i].v) &&
                 (c.normal.empty() || c.normal[i] == all[i].normal) &&
                 (c.toi.empty() || c.toi[i] == all[i].toi);
        if (s % 2 == 1) good = good && found_by(detector, frames, s) == truth[s];
      }
    }
  report(good, frames.name + ", some fields of the contacts");
}

// A step that needs the exact stage after steps that did not.
void check_late_exact() {
  std::vector<bool> exact(26, false);
  for (const int s : {0, 1, 12, 24, 25}) exact[static_cast<std::size_t>(s)] = true;
  for (const std::int32_t count : {60, 200}) {
    const Frames frames = lattice(count, exact);
    const std::vector<Found> truth = truth_of(frames);
    for (const std::uint32_t hint : {0u, 1u}) {
      DetectorOptions options = on(Backend::cuda);
      options.algorithm.tuning.capacity_hint = hint;
      Detector detector(options);
      detector.set_topology(frames.topology());
      bool good = true;
      std::int64_t queries = 0;
      for (std::size_t s = 0; s < frames.steps(); ++s) {
        good = good && found_by(detector, frames, s) == truth[s];
        queries += detector.stats().exact_tests;
      }
      report(good && queries > 0 && detector.status() == "cuda",
             frames.name + ", the exact stage in some steps only, capacity " +
                 std::to_string(hint) + ": " + std::to_string(queries) + " queries");
    }
  }
}

// Steps that start where the last one ended, but for one vertex. The device then works on the last
// end until the host has seen the difference.
void check_changed_starts(const Frames& frames, DetectorOptions options, const std::string& what) {
  options.backend = Backend::cuda;
  Detector gpu(options), cpu(on(Backend::cpu));
  gpu.set_topology(frames.topology());
  cpu.set_topology(frames.topology());
  const std::size_t count = frames.at[0].size();
  int wrong = 0;
  const auto step = [&](const std::vector<double>& start, const std::vector<double>& end) {
    const Positions from(start.data(), count / 3), to(end.data(), count / 3);
    const Span<const Contact> found = gpu.detect(from, to), wanted = cpu.detect(from, to);
    const bool good =
        gpu.stats().backend == "cuda" && gpu.stats().hash == cpu.stats().hash &&
        Found{{found.begin(), found.end()}, 0} == Found{{wanted.begin(), wanted.end()}, 0};
    wrong += !good;
  };
  const auto frame = [&](std::size_t i) {
    const std::vector<float>& x = frames.at[i % frames.at.size()];
    return std::vector<double>(x.begin(), x.end());
  };
  std::size_t i = 0;
  for (const std::size_t changed : {std::size_t{0}, count / 3, count / 2 + 5, count - 1})
    for (const double by : {0.25, 0.0, 0.0, 0.5, 1e-12, 0.0}) {  // floats do not hold 1e-12
      std::vector<double> start = frame(i);
      start[changed] += by;
      step(start, frame(i + 1));
      ++i;
    }
  // A start that is not finite is refused, and forgotten.
  std::vector<double> bad = frame(i);
  bad[count / 2 + 5] = std::numeric_limits<double>::quiet_NaN();
  bool refused = false;
  try {
    gpu.detect({bad.data(), count / 3}, {frame(i + 1).data(), count / 3});
  } catch (const Error& error) {
    refused = error.code() == ErrorCode::non_finite_position;
  }
  step(frame(i), frame(i + 1));
  step(frame(i + 1), frame(i + 2));
  report(wrong == 0 && refused, frames.name + ", starts that differ from the last end, " + what +
                                    ": " + std::to_string(wrong) + " steps wrong" +
                                    (refused ? "" : ", NaN taken") + ", " + gpu.status());
}

}  // namespace

int main(int argc, char** argv) {
  lazyccd::register_research();
  const bool small = argc > 1 && std::string(argv[1]) == "--small";
  if (skips_without_cuda()) return kSkipped;
  try {
    const auto [few, many, exact] = CheckedFrames(small);
    for (const Frames* frames : {&few, &many, &exact}) {
      if (small && frames == &many) continue;
      check_columns(*frames);
      DetectorOptions options;
      check_changed_starts(*frames, options, "defaults");
      options.algorithm.rebuild_every_step = true;
      check_changed_starts(*frames, options, "rebuilt each step");
      options = {};
      options.algorithm.tuning.capacity_hint = 1;
      check_changed_starts(*frames, options, "capacity 1");
      options = {};
      options.algorithm.culling.normal_cones = true;
      check_changed_starts(*frames, options, "normal cones");
      options = {};
      options.algorithm.tuning.graph = false;
      check_changed_starts(*frames, options, "no graph");
    }
    if (!small) check_late_exact();
  } catch (const std::exception& error) {
    report(false, error.what());
  }
  std::printf("%d failed\n", failures);
  return failures == 0 ? 0 : 1;
}
