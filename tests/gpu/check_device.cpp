// Detection from device memory to device memory, failures of the device, short memory, and several
// detectors and devices: always the contacts and the hash of the CPU. It uses no test framework, so
// that it runs on a machine that has only the driver installed.
//
//   check_device [--small]     # --small: small scenes, for the sanitizers
#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "backend_choice.h"
#include "device_probe.h"
#include "frames.h"
#include "gpu/device/device_buffer.h"
#include "gpu/device/stream.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "models/worlds.h"
#include "report.h"

namespace {

using namespace lazyccd;

// Copies to the device and waits. Ordinary host memory may otherwise be on its way still when a
// stream that does not wait for the default stream reads the copy.
void copy_to_device(void* to, const void* from, std::size_t bytes) {
  LAZYCCD_CUDA_CHECK(cudaMemcpy(to, from, bytes, cudaMemcpyHostToDevice));
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(cudaStreamLegacy));
}

// Frames in device memory, `extra` scalars longer per vertex, as Scalar.
template <class Scalar>
struct OnDevice {
  std::vector<DeviceBuffer<Scalar>> frames;
  std::size_t count, width;

  OnDevice(const Frames& f, std::size_t extra) : count(f.body_of_vertex.size()), width(3 + extra) {
    for (const std::vector<float>& x : f.at) {
      std::vector<Scalar> wide(count * width, Scalar{-7});
      for (std::size_t v = 0; v < count; ++v)
        for (std::size_t k = 0; k < 3; ++k) wide[v * width + k] = x[3 * v + k];
      frames.emplace_back(wide.size());
      copy_to_device(frames.back().data(), wide.data(), frames.back().bytes());
    }
  }
  DevicePositions positions(std::size_t f) const {
    return {frames[f].data(), count, width * sizeof(Scalar)};
  }
};

// Downloads what a caller on the device finds, without the detector's help.
Found read(const DeviceContacts& found, DeviceStatus& status) {
  LAZYCCD_CUDA_CHECK(cudaMemcpy(&status, found.status, sizeof(status), cudaMemcpyDeviceToHost));
  Found copy{std::vector<Contact>(status.count), status.hash};
  if (status.count != 0)
    LAZYCCD_CUDA_CHECK(cudaMemcpy(copy.contacts.data(), found.contacts,
                                  status.count * sizeof(Contact), cudaMemcpyDeviceToHost));
  return copy;
}

template <class Scalar>
void check_resident(const Frames& frames, DetectorOptions options, const std::string& what) {
  const std::vector<Found> truth = truth_of(frames);
  const OnDevice<Scalar> device(frames, what == "wide vertices" ? 5 : 0);
  options.backend = Backend::cuda;
  Detector detector(options);
  detector.set_topology(frames.topology());
  gpu::Stream streams[2];
  bool complete = true, honest = true;
  DeviceStatus status{};
  // Each step completed, and read on the stream without completion.
  for (int round = 0; round < 2; ++round)
    for (std::size_t s = 0; s < frames.steps(); ++s) {
      const gpu::Stream& stream = streams[s % 2];
      const DeviceContacts early =
          detector.detect_async(device.positions(s), device.positions(s + 1), stream);
      LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
      const Found seen = read(early, status);
      honest = honest && ((status.incomplete != 0) || seen == truth[s]);
      if (round == 1) continue;
      const DeviceContacts all = detector.synchronize();
      complete = complete && read(all, status) == truth[s] && status.incomplete == 0 &&
                 detector.stats().hash == truth[s].hash;
      const Span<const Contact> host = detector.download_contacts();
      complete = complete && Found{{host.begin(), host.end()}, contact_hash(host)} == truth[s];
    }
  honest = honest && status.incomplete == 0;  // by now there is room for all
  // Steps behind one another, without a wait.
  for (std::size_t s = 0; s < 3 * frames.steps(); ++s)
    detector.detect_async(device.positions(s % frames.steps()),
                          device.positions(s % frames.steps() + 1), streams[s / 2 % 2]);
  const bool ahead = read(detector.synchronize(), status) == truth.back();
  // The default stream, which cannot be captured.
  detector.detect_async(device.positions(0), device.positions(1), nullptr);
  const bool by_default = read(detector.synchronize(), status) == truth[0];
  // The host's positions in between.
  const bool mixed = found_by(detector, frames, 0) == truth[0];
  report(complete && honest && ahead && by_default && mixed,
         frames.name + " in device memory, " + what + ": " +
             std::to_string(truth.back().contacts.size()) + " contacts" +
             (complete ? "" : ", not complete") + (honest ? "" : ", wrong status") +
             (ahead ? "" : ", wrong after steps ahead") +
             (by_default ? "" : ", wrong on the default stream") +
             (mixed ? "" : ", wrong from the host"));
}

// Positions that only the CPU takes: more often than a device may fail, and the device is kept.
void check_too_large(const Frames& frames) {
  Frames large = frames;
  for (std::vector<float>& x : large.at) x.back() = 0x1p101f;
  const std::vector<Found> truth = truth_of(frames), truth_of_large = truth_of(large);
  Detector detector(on(Backend::cuda));
  detector.set_topology(frames.topology());
  const auto works = [&] {
    return found_by(detector, frames, 0) == truth[0] && detector.stats().backend == "cuda" &&
           detector.status() == "cuda";
  };
  bool from_host = works();
  for (std::size_t s = 0; s < 4; ++s)
    from_host = from_host && found_by(detector, large, s) == truth_of_large[s] &&
                detector.stats().backend == "cpu" &&
                detector.status().find("2^100") != std::string::npos;
  from_host = from_host && works();
  const ContactColumns columns =
      detector.detect_columns(large.positions(0), large.positions(1), kTimeField);
  from_host = from_host && columns.count == truth_of_large[0].contacts.size() && works();

  const OnDevice<float> memory(frames, 0), large_memory(large, 0);
  gpu::Stream stream;
  DeviceStatus status{};
  bool on_device = true;
  for (std::size_t s = 0; s < 4; ++s) {
    detector.detect_async(large_memory.positions(s), large_memory.positions(s + 1), stream);
    try {
      detector.synchronize();
      on_device = false;
    } catch (const Error& error) {
      on_device = on_device && error.code() == ErrorCode::device;
    }
  }
  detector.detect_async(memory.positions(0), memory.positions(1), stream);
  on_device = on_device && read(detector.synchronize(), status) == truth[0] &&
              status.incomplete == 0 && detector.status() == "cuda" && works();
  report(from_host && on_device, frames.name + ", a position beyond 2^100" +
                                     (from_host ? "" : ", wrong from the host") +
                                     (on_device ? "" : ", wrong in device memory"));
}

// The contacts of steps in device memory on the host, where there are some.
void check_download(const Frames& frames, std::uint32_t hint) {
  const std::vector<Found> truth = truth_of(frames);
  const OnDevice<float> memory(frames, 0);
  gpu::Stream stream;
  DetectorOptions options = on(Backend::cuda);
  options.algorithm.tuning.capacity_hint = hint;
  Detector detector(options);
  const auto downloaded = [&] {
    const Span<const Contact> c = detector.download_contacts();
    return Found{{c.begin(), c.end()}, contact_hash(c)};
  };
  bool good = downloaded() == Found();
  for (std::size_t s = 0; s < frames.steps(); ++s) {
    detector.set_topology(frames.topology());
    good = good && downloaded() == Found();
    detector.detect_async(memory.positions(s), memory.positions(s + 1), stream);
    good = good && downloaded() == truth[s] && downloaded() == truth[s];
    good = good && found_by(detector, frames, 0) == truth[0] && downloaded() == Found();
    detector.detect_async(memory.positions(s), memory.positions(s + 1), stream);
    good = good && downloaded() == truth[s];
  }
  report(good, frames.name + ", downloads, capacity " + std::to_string(hint));
}

void check_mask(const Frames& frames, std::int32_t count, DetectorOptions options,
                const std::string& what) {
  const std::vector<Found> truth = truth_of(frames);
  const OnDevice<float> device(frames, 0);
  options.backend = Backend::cuda;
  Detector detector(options);
  detector.set_topology(frames.topology());
  gpu::Stream stream;
  DeviceBuffer<std::uint8_t> mask(static_cast<std::size_t>(count));
  bool good = true;
  for (std::size_t s = 0; s < frames.steps(); ++s) {
    std::vector<std::uint8_t> chosen;
    for (std::int32_t w = 0; w < count; ++w)
      chosen.push_back((static_cast<std::size_t>(w) + s) % 3 != 0);
    copy_to_device(mask.data(), chosen.data(), mask.bytes());
    Found wanted;
    for (const Contact& c : truth[s].contacts) {
      const std::int32_t w = std::max(frames.bodies[c.body_a].world, frames.bodies[c.body_b].world);
      if (w < 0 || chosen[w] != 0) wanted.contacts.push_back(c);
    }
    wanted.hash = contact_hash(wanted.contacts);
    detector.detect_async(device.positions(s), device.positions(s + 1), stream, mask.data());
    DeviceStatus status{};
    good = good && read(detector.synchronize(), status) == wanted;
    // The positions of the worlds that are left out do not matter.
    Frames bad = frames;
    bad.at = {frames.at[s], frames.at[s + 1]};
    for (std::size_t v = 0; v < bad.body_of_vertex.size(); ++v) {
      const std::int32_t w = bad.bodies[static_cast<std::size_t>(bad.body_of_vertex[v])].world;
      if (w < 0 || chosen[static_cast<std::size_t>(w)] != 0) continue;
      bad.at[0][3 * v] = std::numeric_limits<float>::quiet_NaN();
      bad.at[1][3 * v + 1] = 0x1p101f;
    }
    const OnDevice<float> bad_memory(bad, 0);
    detector.detect_async(bad_memory.positions(0), bad_memory.positions(1), stream, mask.data());
    good = good && read(detector.synchronize(), status) == wanted && status.incomplete == 0;
    // No world at all, and all of them again.
    const std::vector<std::uint8_t> none(chosen.size());
    copy_to_device(mask.data(), none.data(), mask.bytes());
    detector.detect_async(device.positions(s), device.positions(s + 1), stream, mask.data());
    good = good && read(detector.synchronize(), status).contacts.empty();
    detector.detect_async(device.positions(s), device.positions(s + 1), stream);
    good = good && read(detector.synchronize(), status) == truth[s];
  }
  report(good, frames.name + " with a mask of worlds, " + what);
}

void check_short_memory(const Frames& frames) {
  const std::vector<Found> truth = truth_of(frames);
  const OnDevice<float> memory(frames, 0);
  gpu::Stream stream;
  for (const std::size_t kilobytes : {4096, 2048, 1024, 512, 256, 1}) {
    Detector detector(on(Backend::cuda));
    detector.set_topology(frames.topology());
    bool good = true;
    std::int64_t parts = 0;
    std::string backend;
    for (std::size_t s = 0; s < frames.steps(); ++s) {
      // The scene itself fits; the lists of the step do not.
      if (s == 0) {
        found_by(detector, frames, s);
        continue;
      }
      gpu::faults.most_bytes = kilobytes << 10;
      good = good && found_by(detector, frames, s) == truth[s];
      gpu::faults.most_bytes = 0;
      parts = std::max(parts, detector.stats().parts);
      backend = detector.stats().backend;
    }
    // Little memory in one step only: soon there is room for all, without a wait.
    Detector brief(on(Backend::cuda));
    brief.set_topology(frames.topology());
    found_by(brief, frames, 0);
    const std::size_t last = frames.steps() - 1;
    gpu::faults.most_bytes = kilobytes << 10;
    good = good && found_by(brief, frames, last) == truth[last];
    gpu::faults.most_bytes = 0;
    const std::int64_t brief_parts = brief.stats().parts;
    DeviceStatus status{};
    Found seen;
    for (int step = 0; step == 0 || (step < 64 && status.incomplete != 0); ++step) {
      const DeviceContacts found =
          brief.detect_async(memory.positions(last), memory.positions(last + 1), stream);
      LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
      seen = read(found, status);
    }
    const bool recovers = status.incomplete == 0 && seen == truth[last];
    // From the beginning with little memory.
    gpu::faults.most_bytes = kilobytes << 10;
    Detector poor(on(Backend::cuda));
    poor.set_topology(frames.topology());
    std::int64_t poor_parts = 0;
    for (std::size_t s = 0; s < frames.steps(); ++s) {
      good = good && found_by(poor, frames, s) == truth[s];
      poor_parts = std::max(poor_parts, poor.stats().parts);
    }
    gpu::faults.most_bytes = 0;
    const bool says = poor.stats().backend == "cuda" ||
                      poor.status().find("cudaErrorMemoryAllocation") != std::string::npos;
    report(good && says && recovers,
           frames.name + ", buffers of at most " + std::to_string(kilobytes) +
               " KB: " + poor.stats().backend + ", " + std::to_string(poor_parts) +
               " parts; in one step: " + std::to_string(brief_parts) + " parts" +
               (recovers ? "" : ", and short for good"));
  }
}

// Lets every checked call of a detection fail, one after the other.
void check_faults(const Frames& frames, bool few) {
  const std::vector<Found> truth = truth_of(frames);
  for (const bool lost : {false, true}) {
    const std::vector<cudaError_t> errors =
        lost ? std::vector<cudaError_t>{cudaErrorLaunchFailure}
             : std::vector<cudaError_t>{cudaErrorMemoryAllocation, cudaErrorUnknown};
    for (const cudaError_t error : errors) {
      bool good = true;
      long failed = 0, calls = 0;
      for (long call = 0; good && call < 1000; call += few ? 17 : 1) {
        Detector detector(on(Backend::cuda));
        detector.set_topology(frames.topology());
        found_by(detector, frames, 0);
        gpu::faults = {call, lost, error, 0};
        good = good && found_by(detector, frames, 1) == truth[1];
        const bool reached = gpu::faults.call < 0 || (lost && gpu::faults.call == 0);
        gpu::faults = {};
        failed += detector.stats().backend == "cpu";
        calls = call;
        if (detector.stats().backend == "cpu")
          good = good && detector.status().find(cudaGetErrorName(error)) != std::string::npos;
        // The next step works on the device again.
        good =
            good && found_by(detector, frames, 2) == truth[2] && detector.stats().backend == "cuda";
        if (!reached) break;
      }
      report(good && failed > 0, frames.name + ": " + cudaGetErrorName(error) +
                                     (lost ? " from" : " at") + " each of " +
                                     std::to_string(calls) + " calls of a step; " +
                                     std::to_string(failed) + " steps by the CPU");
    }
  }
}

void check_two_detectors(const Frames& a, const Frames& b) {
  const std::vector<Found> truth_a = truth_of(a), truth_b = truth_of(b);
  Detector first(on(Backend::cuda)), second(on(Backend::cuda));
  first.set_topology(a.topology());
  second.set_topology(b.topology());
  bool good = true;
  for (std::size_t s = 0; s < std::min(a.steps(), b.steps()); ++s)
    good = good && found_by(first, a, s) == truth_a[s] && found_by(second, b, s) == truth_b[s];
  bool at_once[2] = {true, true};
  const auto run = [&](int which, Detector& detector, const Frames& frames,
                       const std::vector<Found>& truth) {
    for (int round = 0; round < 10; ++round)
      for (std::size_t s = 0; s < frames.steps(); ++s)
        at_once[which] = at_once[which] && found_by(detector, frames, s) == truth[s];
  };
  std::thread other([&] { run(1, second, b, truth_b); });
  run(0, first, a, truth_a);
  other.join();
  report(good && at_once[0] && at_once[1] && first.status() == "cuda" && second.status() == "cuda",
         "two detectors on one device, in turn and at once");
}

void check_devices(const Frames& frames) {
  const std::vector<Found> truth = truth_of(frames);
  int devices = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDeviceCount(&devices));
  std::vector<std::unique_ptr<Detector>> detectors;
  for (int d = 0; d < devices; ++d) {
    DetectorOptions options = on(Backend::cuda);
    options.device = d;
    detectors.push_back(std::make_unique<Detector>(options));
    detectors.back()->set_topology(frames.topology());
  }
  std::vector<char> good(static_cast<std::size_t>(devices), 1);
  const auto run = [&](int d) {
    for (std::size_t s = 0; s < frames.steps(); ++s)
      good[d] = good[d] && found_by(*detectors[d], frames, s) == truth[s] &&
                detectors[d]->status() == "cuda";
  };
  for (int round = 0; round < 3; ++round)
    for (int d = 0; d < devices; ++d) run(d);
  std::vector<std::thread> threads;
  for (int d = 0; d < devices; ++d) threads.emplace_back(run, d);
  for (std::thread& thread : threads) thread.join();
  for (int d = 0; d < devices; ++d) {
    LAZYCCD_CUDA_CHECK(cudaSetDevice(d));
    const OnDevice<float> memory(frames, 0);
    gpu::Stream stream;
    LAZYCCD_CUDA_CHECK(cudaSetDevice(0));  // the detector changes to its own device, and back
    detectors[d]->detect_async(memory.positions(0), memory.positions(1), stream);
    const Span<const Contact> c = detectors[d]->download_contacts();
    int current = -1;
    LAZYCCD_CUDA_CHECK(cudaGetDevice(&current));
    good[d] = good[d] && current == 0 && Found{{c.begin(), c.end()}, contact_hash(c)} == truth[0];
  }
  DetectorOptions options = on(Backend::cuda);
  options.device = devices;
  const bool refused = Detector(options).status().find("no device") != std::string::npos;
  report(refused && std::count(good.begin(), good.end(), 1) == devices,
         "a detector on each of " + std::to_string(devices) + " devices");
}

// Backend::automatic: the CPU for a small scene, the GPU for a large one, the same contacts. A
// topology that is refused leaves everything as it was.
void check_automatic(const Frames& large) {
  const Frames small = worlds(2, 2, 3);
  Detector detector(on(Backend::automatic));
  bool good = true;
  for (const Frames* frames : {&small, &large, &small, &large}) {
    const std::vector<Found> truth = truth_of(*frames);
    const std::string expected =
        frames->faces.size() < BackendChoice::min_first_gpu_faces ? "cpu" : "cuda";
    detector.set_topology(frames->topology());
    good = good && found_by(detector, *frames, 0) == truth[0] && detector.status() == expected &&
           detector.stats().backend == expected;
    const std::vector<Face> bad_faces(5000, Face{0, 1, 1 << 30});
    Topology bad = frames->topology();
    bad.faces = {bad_faces.data(), bad_faces.size()};
    try {
      detector.set_topology(bad);
      good = false;
    } catch (const Error& error) {
      good = good && error.code() != ErrorCode::device;
    }
    good = good && found_by(detector, *frames, 0) == truth[0] && detector.status() == expected;
    const OnDevice<float> memory(*frames, 0);
    gpu::Stream stream;
    detector.detect_async(memory.positions(0), memory.positions(1), stream);
    const Span<const Contact> c = detector.download_contacts();
    good = good && Found{{c.begin(), c.end()}, contact_hash(c)} == truth[0] &&
           found_by(detector, *frames, 0) == truth[0];
  }
  report(good, "the automatic choice between the CPU and the GPU");
}

// World numbers near the largest integer must not cost memory.
void check_large_worlds() {
  Frames frames = worlds(6, 3, 3);
  for (Body& body : frames.bodies)
    if (body.world >= 0) body.world = 0x7ffffffe - 77 * (5 - body.world);
  const std::vector<Found> truth = truth_of(frames);
  Detector gpu(on(Backend::cuda)), cpu(on(Backend::cpu));
  gpu.set_topology(frames.topology());
  cpu.set_topology(frames.topology());
  bool good = found_by(gpu, frames, 0) == truth[0] && gpu.status() == "cuda" &&
              gpu.stats().peak_bytes < 100'000'000;
  found_by(cpu, frames, 0);
  for (const std::int32_t w : {0, 0x7ffffffe, 0x7ffffffe - 77, -1, 12345})
    good = good && gpu.hash_of_world(w) == cpu.hash_of_world(w) &&
           gpu.contacts_of_world(w).size() == cpu.contacts_of_world(w).size();
  report(good, "worlds numbered up to 2^31 - 2: " + std::to_string(gpu.stats().peak_bytes) +
                   " bytes on the device");
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
      DetectorOptions options;
      check_resident<float>(*frames, options, "float");
      check_resident<double>(*frames, options, "double");
      check_resident<float>(*frames, options, "wide vertices");
      options.algorithm.rebuild_every_step = true;
      check_resident<float>(*frames, options, "rebuilt each step");
      options.algorithm.rebuild_every_step = false;
      options.algorithm.tuning.capacity_hint = 1;
      check_resident<float>(*frames, options, "capacity 1");
      options.algorithm.tuning.capacity_hint = 0;
      for (const Strategy strategy : kStrategies) {
        options.algorithm.strategy = strategy;
        check_resident<float>(*frames, options, name(strategy));
      }
      options = {};
      options.algorithm.tuning.graph = false;
      check_resident<float>(*frames, options, "no graph");
    }
    for (const Volume volume : kVolumes) {
      DetectorOptions options;
      options.algorithm.volume = volume;
      check_mask(few, small ? 3 : 12, options, name(volume));
    }
    DetectorOptions orphans;
    orphans.algorithm.culling.orphan_sets = true;
    check_mask(crumpled(few), small ? 3 : 12, orphans, "orphan sets");
    check_too_large(few);
    check_automatic(many);
    if (!small) check_mask(many, 300, {}, "many worlds");
    for (const std::uint32_t hint : {0u, 1u}) {
      check_download(few, hint);
      check_download(exact, hint);
    }
    check_faults(few, small);
    check_short_memory(small ? few : many);
    if (!small) check_short_memory(exact);
    check_two_detectors(few, exact);
    check_devices(few);
    check_large_worlds();
  } catch (const std::exception& error) {
    report(false, error.what());
  }
  std::printf("%d failed\n", failures);
  return failures == 0 ? 0 : 1;
}
