// The program lazyccd_device_scaling: times of the GPU over the size of the scene and over the
// number of worlds, beside the CPU and the baseline of one thread a query. Writes one CSV row a
// scene to the standard output. Times are medians, in milliseconds; hashes of all methods must
// agree, otherwise it ends with an error.
//
//   lazyccd_device_scaling [--faces N] [--worlds N] [--cpu-faces N] [--repeat N]
//
//   --faces      the largest scene of one world (default 20 million); 0: none
//   --worlds     the largest number of worlds (default 16384); 0: none
//   --cpu-faces  the CPU and one thread a query are measured up to so many faces
//                (default 2 million)
#include <cuda_runtime_api.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/device/sheets.h"
#include "lazyccd/detector.h"
#include "models/worlds.h"

namespace {

using namespace lazyccd;
using models::Layout;
using models::WorldsScene;
using Scene = models::MovingMesh;
using bench::two_sheets;

double median(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

template <class Body>
double milliseconds(Body&& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

struct Times {
  double device = -1, whole = -1, topology = -1;
  std::int64_t contacts = 0, bytes = 0, overflows = 0;
  std::uint64_t hash = 0;
};

// A detector from and to the host.
Times from_host(const Scene& scene, DetectorOptions options, int repeat) {
  Detector detector(options);
  Times t;
  std::vector<double> topology;
  for (int i = 0; i < 8; ++i) {
    const double ms = milliseconds([&] {
      detector.set_topology(scene.topology());
      detector.detect(scene.positions(0), scene.positions(1));
    });
    if (i >= 3) topology.push_back(ms);  // the first ones reserve memory
  }
  t.topology = median(topology);
  t.hash = detector.stats().hash;
  std::vector<double> device, whole;
  for (int i = 0; i < repeat + 2; ++i) {
    const double ms =
        milliseconds([&] { detector.detect(scene.positions(i % 2), scene.positions(1 - i % 2)); });
    if (i < 2) continue;
    whole.push_back(ms);
    device.push_back(detector.stats().ms_device);
  }
  const Stats& stats = detector.stats();
  if (options.backend == Backend::cuda && stats.backend != "cuda")
    throw std::runtime_error(detector.status());
  t.device = median(device);
  t.whole = median(whole);
  t.contacts = stats.contacts_vf + stats.contacts_ee;
  t.bytes = stats.peak_bytes;
  t.overflows = stats.overflows;
  return t;
}

void check(cudaError_t result) {
  if (result != cudaSuccess) throw std::runtime_error(cudaGetErrorString(result));
}

// A caller on the device: positions and contacts stay there. Milliseconds of a detection, of many
// that are enqueued one after another, and of one that is waited for.
struct Resident {
  double enqueued = 0, waited = 0;
};
Resident on_device(const Scene& scene, DetectorOptions options, int repeat, std::uint64_t hash) {
  Detector detector(options);
  detector.set_topology(scene.topology());
  float* x[2];
  const std::size_t count = scene.at[0].size() / 3, bytes = scene.at[0].size() * sizeof(float);
  for (int end = 0; end < 2; ++end) {
    check(cudaMalloc(reinterpret_cast<void**>(&x[end]), bytes));
    check(cudaMemcpy(x[end], scene.at[end].data(), bytes, cudaMemcpyHostToDevice));
    check(cudaStreamSynchronize(cudaStreamLegacy));  // other streams do not wait for it
  }
  cudaStream_t stream;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  const auto enqueue = [&](int i) {
    detector.detect_async(DevicePositions(x[i % 2], count), DevicePositions(x[1 - i % 2], count),
                          stream);
  };
  for (int i = 0; i < 4; ++i) {
    enqueue(i);
    detector.synchronize();
    if (i % 2 == 0 && detector.stats().hash != hash)
      throw std::runtime_error("another hash in device memory");
  }
  std::vector<double> waited;
  for (int i = 0; i < repeat; ++i)
    waited.push_back(milliseconds([&] {
      enqueue(i);
      check(cudaStreamSynchronize(stream));
    }));
  Resident r;
  r.waited = median(waited);
  r.enqueued = milliseconds([&] {
                 for (int i = 0; i < repeat; ++i) enqueue(i);
                 check(cudaStreamSynchronize(stream));
               }) /
               repeat;
  detector.synchronize();
  for (float* p : x) check(cudaFree(p));
  check(cudaStreamDestroy(stream));
  return r;
}

void row(const char* kind, std::int64_t worlds, const Scene& scene, bool with_cpu, int repeat) {
  DetectorOptions cuda;
  cuda.backend = Backend::cuda;
  const Times gpu = from_host(scene, cuda, repeat);
  const Resident resident = on_device(scene, cuda, repeat, gpu.hash);
  DetectorOptions rebuilding = cuda;
  rebuilding.algorithm.rebuild_every_step = true;
  const Resident rebuilt = on_device(scene, rebuilding, repeat, gpu.hash);
  Times cpu, baseline;
  if (with_cpu) {
    DetectorOptions options;
    options.backend = Backend::cpu;
    cpu = from_host(scene, options, std::min(repeat, 7));
    DetectorOptions one = cuda;
    one.algorithm.strategy = Strategy::thread_per_query;
    baseline = from_host(scene, one, repeat);
    if (cpu.hash != gpu.hash || baseline.hash != gpu.hash)
      throw std::runtime_error("the methods find different contacts");
  }
  const auto faces = static_cast<std::int64_t>(scene.faces.size());
  std::printf("%s,%lld,%lld,%lld,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.1f\n", kind,
              static_cast<long long>(worlds), static_cast<long long>(faces),
              static_cast<long long>(gpu.contacts), gpu.device, gpu.whole, resident.enqueued,
              resident.waited, rebuilt.enqueued - resident.enqueued, gpu.topology, baseline.device,
              cpu.whole, static_cast<double>(gpu.bytes) / static_cast<double>(faces));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  lazyccd::register_research();
  std::int64_t most_faces = 20'000'000, most_worlds = 16384, cpu_faces = 2'000'000;
  int repeat = 31;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string option = argv[i];
    const std::int64_t value = std::atoll(argv[i + 1]);
    if (option == "--faces") most_faces = value;
    if (option == "--worlds") most_worlds = value;
    if (option == "--cpu-faces") cpu_faces = value;
    if (option == "--repeat") repeat = static_cast<int>(value);
  }
  try {
    std::printf(
        "scene,worlds,faces,contacts,device_ms,whole_ms,resident_ms,resident_waited_ms,rebuild_ms,"
        "new_topology_ms,thread_per_query_device_ms,cpu_ms,bytes_a_face\n");
    for (const double faces : {1e3, 4e3, 16e3, 65e3, 196e3, 650e3, 2e6, 8e6, 20e6}) {
      if (faces > 1.01 * static_cast<double>(most_faces)) continue;
      const Scene scene = two_sheets(static_cast<int>(std::lround(std::sqrt(faces / 4))));
      row("sheets", 1, scene, faces <= 1.01 * static_cast<double>(cpu_faces),
          faces > 1e6 ? std::min(repeat, 7) : repeat);
    }
    for (std::int64_t worlds = 1; worlds <= most_worlds; worlds *= 4) {
      const auto count = static_cast<std::int32_t>(worlds);
      const WorldsScene scene(count, 10, Layout::one_place);
      row("worlds", worlds, scene, static_cast<std::int64_t>(scene.faces.size()) <= cpu_faces,
          scene.faces.size() > 1000000 ? std::min(repeat, 7) : repeat);
      if (worlds == 4096)
        row("one world as large", 1, WorldsScene(count, 10, Layout::side_by_side), false,
            std::min(repeat, 7));
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lazyccd_device_scaling: %s\n", error.what());
    return 1;
  }
}
