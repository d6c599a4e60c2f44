// The program lazyccd_device_costs: times of the GPU on scenes that show single stages. Writes one
// line for each to the standard output. Medians, in milliseconds.
//
//   lazyccd_device_costs [START.ply END.ply ...]
//
// First the exact stage: triangles with corners on a lattice, once with coordinates of few bits and
// once moved so that they need more. Then each pair of frames: from and to the host, with whole
// contacts and with a few of their fields.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/ply.h"
#include "lazyccd/detector.h"
#include "models/worlds.h"

namespace {

using namespace lazyccd;

double median(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

// Medians of a detection.
struct Times {
  double device, upload, whole;
};
template <class Detect>
Times time(Detector& detector, int repeat, Detect&& detect) {
  std::vector<double> device, upload, whole;
  for (int i = 0; i < repeat + 4; ++i) {
    const auto start = std::chrono::steady_clock::now();
    detect(i);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    if (i < 4) continue;
    whole.push_back(ms.count());
    device.push_back(detector.stats().ms_device);
    upload.push_back(detector.stats().ms_upload);
  }
  if (detector.stats().backend != "cuda") throw std::runtime_error(detector.status());
  return {median(device), median(upload), median(whole)};
}

void print(const char* what, const Times& t, const Stats& stats) {
  std::printf("%-58s contacts %8lld exact %6lld device %8.4f upload %7.4f whole %8.4f hash %llx\n",
              what, static_cast<long long>(stats.contacts_vf + stats.contacts_ee),
              static_cast<long long>(stats.exact_tests), t.device, t.upload, t.whole,
              static_cast<unsigned long long>(stats.hash));
  std::fflush(stdout);
}

DetectorOptions on(Backend backend) {
  DetectorOptions options;
  options.backend = backend;
  return options;
}

// shift: added to every coordinate in the direction of the axis, so that it has more bits.
void time_lattice(std::int32_t count, float shift) {
  models::MovingMesh scene;
  std::mt19937 random(11);
  for (std::int32_t i = 0; i < count; ++i) {
    scene.bodies.emplace_back();
    scene.body_of_vertex.insert(scene.body_of_vertex.end(), 3, i);
    scene.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  for (auto& x : scene.at)
    for (std::int32_t v = 0; v < 3 * count; ++v)
      for (int k = 0; k < 3; ++k)
        x.push_back(static_cast<float>(random() % 8u) * (shift != 0 ? 0.1f : 1.0f) + shift);
  Detector cuda(on(Backend::cuda)), cpu(on(Backend::cpu));
  for (Detector* detector : {&cuda, &cpu}) detector->set_topology(scene.topology());
  const Times t = time(cuda, 31, [&](int) { cuda.detect(scene.positions(0), scene.positions(1)); });
  cpu.detect(scene.positions(0), scene.positions(1));
  if (cpu.stats().hash != cuda.stats().hash) throw std::runtime_error("the CPU differs");
  print((std::to_string(count) + " triangles on a lattice" + (shift != 0 ? ", many bits" : ""))
            .c_str(),
        t, cuda.stats());
}

void time_frames(const std::string& start_name, const std::string& end_name) {
  const io::Mesh start = io::read_ply(start_name), end = io::read_ply(end_name);
  const Positions at[2] = {io::positions(start), io::positions(end)};
  Detector cuda(on(Backend::cuda));
  cuda.set_topology(io::topology(start));
  const std::string name = start_name.substr(start_name.rfind('/') + 1);
  const auto row = [&](const std::string& what, auto&& detect) {
    const Times t = time(cuda, 61, detect);
    print((name + what).c_str(), t, cuda.stats());
  };
  row(", whole contacts", [&](int) { cuda.detect(at[0], at[1]); });
  row(", whole contacts, forth and back, so the start lies there",
      [&](int i) { cuda.detect(at[i % 2], at[1 - i % 2]); });
  struct Choice {
    const char* name;
    std::uint32_t fields;
  };
  for (const Choice& choice :
       {Choice{", vertices, point, normal, time",
               kVerticesField | kPointField | kNormalField | kTimeField},
        Choice{", vertices and time", kVerticesField | kTimeField}, Choice{", time", kTimeField}})
    row(choice.name, [&](int) { cuda.detect_columns(at[0], at[1], choice.fields); });
}

}  // namespace

int main(int argc, char** argv) {
  try {
    for (const float shift : {0.0f, 1.7f})
      for (const std::int32_t count : {50, 100, 120, 200, 400}) time_lattice(count, shift);
    for (int i = 1; i + 1 < argc; i += 2) time_frames(argv[i], argv[i + 1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lazyccd_device_costs: %s\n", error.what());
    return 1;
  }
}
