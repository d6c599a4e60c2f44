// The program lazyccd_device_choice: Backend::automatic beside the CPU and the GPU, on sheets that
// move, lie at rest, and do both in turn. Writes one CSV row a scene to the standard output. Times
// are means of a detection, in milliseconds, trials included: over all detections, and over the
// last quarter ("late"). The hashes of all must agree in every step, otherwise it ends with an
// error.
//
//   lazyccd_device_choice [--steps N]     # detections of a small scene; default 20000
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/device/sheets.h"
#include "lazyccd/detector.h"

namespace {

using namespace lazyccd;

// A phase moves by whole steps of the scene, or hardly.
enum class Motion { moving, resting, in_turn };

const char* name(Motion motion) {
  return motion == Motion::moving ? "moving" : motion == Motion::resting ? "at rest" : "in turn";
}

// The sheets from step to step.
struct Film {
  Film(int n, Motion m, int count) : scene(bench::two_sheets(n)), motion(m), steps(count) {
    for (std::size_t i = 0; i < scene.at[0].size(); ++i)
      at[0].push_back(scene.at[0][i]), shift.push_back(scene.at[1][i] - scene.at[0][i]);
    at[1] = at[0];
  }
  bool moves(int step) const {
    return motion == Motion::moving ||
           (motion == Motion::in_turn && step % (steps / 4) < steps / 8);
  }
  // Moves the positions on to the end of a step: to and fro, in 16 steps.
  void advance(int step) {
    at[0].swap(at[1]);
    const float size = moves(step) ? 0.5f : 1e-4f, sign = step / 16 % 2 == 0 ? size : -size;
    for (std::size_t i = 0; i < shift.size(); ++i) at[1][i] = at[0][i] + sign * shift[i];
  }
  Positions positions(int end) const { return {at[end].data(), at[end].size() / 3}; }

  models::MovingMesh scene;
  std::vector<float> shift;
  std::array<std::vector<float>, 2> at;
  Motion motion;
  int steps;
};

struct Result {
  double ms = 0, late_ms = 0;  // means of a detection, over all and over the last quarter
  double share_on_gpu = 0;     // of the detections
  std::vector<std::uint64_t> hashes;
};

Result run(Film film, Backend backend, double separation) {
  DetectorOptions options;
  options.backend = backend;
  options.separation = separation;
  Detector detector(options);
  detector.set_topology(film.scene.topology());
  Result result;
  for (int step = 0; step < film.steps; ++step) {
    film.advance(step);
    const auto start = std::chrono::steady_clock::now();
    detector.detect(film.positions(0), film.positions(1));
    const auto end = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(end - start).count();
    result.ms += ms / film.steps;
    if (step >= film.steps - film.steps / 4) result.late_ms += ms / (film.steps / 4);
    result.share_on_gpu += (detector.stats().backend == "cuda") / static_cast<double>(film.steps);
    result.hashes.push_back(detector.stats().hash);
  }
  return result;
}

void measure(int n, Motion motion, int steps) {
  const Film film(n, motion, steps);
  const double separation = 0.1 / n;
  const Result cpu = run(film, Backend::cpu, separation);
  const Result cuda = run(film, Backend::cuda, separation);
  const Result both = run(film, Backend::automatic, separation);
  if (cuda.share_on_gpu == 0) throw std::runtime_error("the GPU did not answer");
  if (cpu.hashes != cuda.hashes || cpu.hashes != both.hashes)
    throw std::runtime_error("the backends disagree");
  std::printf("%s,%d,%d,%.4f,%.4f,%.4f,%.2f,%.4f,%.4f,%.4f,%.2f,%.2f\n", name(motion), 4 * n * n,
              steps, cpu.ms, cuda.ms, both.ms, both.ms / std::min(cpu.ms, cuda.ms), cpu.late_ms,
              cuda.late_ms, both.late_ms, both.late_ms / std::min(cpu.late_ms, cuda.late_ms),
              both.share_on_gpu);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int steps = argc > 2 && std::string(argv[1]) == "--steps" ? std::atoi(argv[2]) : 20000;
  try {
    std::printf(
        "motion,faces,detections,cpu_ms,cuda_ms,automatic_ms,automatic_over_best,late_cpu_ms,"
        "late_cuda_ms,late_automatic_ms,late_automatic_over_best,on_gpu\n");
    for (const Motion motion : {Motion::moving, Motion::resting, Motion::in_turn})
      for (const int n : {8, 16, 23, 32, 64, 128, 220})
        measure(n, motion, std::min(steps, steps * 32 / n));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lazyccd_device_choice: %s\n", error.what());
    return 1;
  }
  return 0;
}
