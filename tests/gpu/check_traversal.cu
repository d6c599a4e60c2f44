// Compares the traversal on the device with a traversal on one thread and with brute force. Every
// pair of leaves and every pair of the front must be found exactly once. It uses no test framework,
// so that it runs on a machine that has only the driver installed. Exit code: 0 passed, 1 failed,
// 77 no device.
//
//   lazyccd_gpu_check [repetitions]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "gpu/device/check.h"
#include "gpu/device/device_buffer.h"
#include "gpu/device/stream.h"
#include "gpu/device/upload.h"
#include "gpu/traversal/traversal.h"
#include "lazyccd/algorithm.h"
#include "lazyccd/error.h"
#include "research/gpu_culling/node_culling.cuh"
#include "traversal_scenes.h"

namespace lazyccd::test {
namespace {

using gpu::Stream;

int failures = 0;

std::string describe(const DetectorOptions& o) {
  const Tuning& t = o.algorithm.tuning;
  return std::string(name(o.algorithm.strategy)) +
         (o.algorithm.front == FrontUse::on ? ", front" : "") + ", block " +
         std::to_string(t.block_size) + ", blocks " + std::to_string(t.blocks) + ", chunk " +
         std::to_string(t.chunk) + ", capacity " + std::to_string(t.capacity_hint) + ", delay " +
         std::to_string(t.delay_ns);
}

void expect(bool condition, const std::string& what, const Scene& scene, std::size_t frame,
            const DetectorOptions& options) {
  if (condition) return;
  ++failures;
  std::printf("FAIL %s: scene %s, frame %zu, %s\n", what.c_str(), scene.name.c_str(), frame,
              describe(options).c_str());
}

std::vector<NodePair> download(const NodePair* pairs, std::size_t count) {
  std::vector<NodePair> host(count);
  if (count != 0)
    LAZYCCD_CUDA_CHECK(
        cudaMemcpy(host.data(), pairs, count * sizeof(NodePair), cudaMemcpyDeviceToHost));
  std::sort(host.begin(), host.end(), [](NodePair x, NodePair y) { return x < y; });
  return host;
}

bool equal(const std::vector<NodePair>& x, const std::vector<NodePair>& y) {
  return x.size() == y.size() &&
         std::equal(x.begin(), x.end(), y.begin(), [](NodePair p, NodePair q) { return p == q; });
}

// The frames of a scene on the device.
class DeviceScene {
 public:
  explicit DeviceScene(const Scene& scene) : scene_(&scene) {
    for (const Frame& frame : scene.frames) {
      DeviceBuffer<TreeNode> nodes(frame.nodes.size());
      if (!frame.nodes.empty())
        LAZYCCD_CUDA_CHECK(
            cudaMemcpy(nodes.data(), frame.nodes.data(), nodes.bytes(), cudaMemcpyHostToDevice));
      nodes_.push_back(std::move(nodes));
      boxes_.emplace_back();
      flat_.emplace_back();
      gpu::upload(boxes_.back(), frame.volumes.boxes.data(), frame.volumes.boxes.size());
      gpu::upload(flat_.back(), frame.volumes.flat.data(), frame.volumes.flat.size());
    }
    counters_.reserve(1);
  }
  const Scene& scene() const { return *scene_; }
  std::uint32_t node_count() const {
    return static_cast<std::uint32_t>(scene_->frames[0].nodes.size());
  }
  const TreeNode* nodes(std::size_t frame) const { return nodes_[frame].data(); }
  gpu::NodeCulling culling(std::size_t frame) {
    return {boxes_[frame].data(), nullptr, flat_[frame].data(), counters_.data()};
  }

 private:
  const Scene* scene_;
  std::vector<DeviceBuffer<TreeNode>> nodes_;
  std::vector<DeviceBuffer<OrientedBoxOf<float>>> boxes_;
  std::vector<DeviceBuffer<unsigned char>> flat_;
  DeviceBuffer<gpu::research::CullingCounters> counters_;
};

enum class Launch { direct, graph };

// An empty kernel: in a detection other kernels precede the traversal.
__global__ void nothing() {}

void run(Traversal& traversal, const TreeNode* nodes, bool from_front, cudaStream_t stream,
         const gpu::NodeCulling* culling = nullptr) {
  nothing<<<1, 1, 0, stream>>>();
  traversal.start(from_front, stream);
  traversal.launch(nodes, {}, culling, from_front, stream);
}

// Launches one traversal. With Launch::graph it captures a graph and launches it, if the traversal
// can be captured.
void launch(Traversal& traversal, const TreeNode* nodes, bool from_front, Launch how,
            cudaStream_t stream) {
  if (how == Launch::direct || traversal.asks_device()) {
    run(traversal, nodes, from_front, stream);
    return;
  }
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  LAZYCCD_CUDA_CHECK(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
  run(traversal, nodes, from_front, stream);
  LAZYCCD_CUDA_CHECK(cudaStreamEndCapture(stream, &graph));
  LAZYCCD_CUDA_CHECK(cudaGraphInstantiate(&executable, graph, 0));
  LAZYCCD_CUDA_CHECK(cudaGraphLaunch(executable, stream));
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
  LAZYCCD_CUDA_CHECK(cudaGraphExecDestroy(executable));
  LAZYCCD_CUDA_CHECK(cudaGraphDestroy(graph));
}

struct Totals {
  std::uint64_t steals = 0, overflows = 0, growths = 0;
};

// Checks all frames of the scene, each `repetitions` times from the same front.
void check(const DeviceScene& device, const DetectorOptions& options, int repetitions, Launch how,
           Totals& totals, cudaStream_t stream) {
  const Scene& scene = device.scene();
  Traversal traversal(options);
  traversal.reset(device.node_count(), stream);
  for (std::size_t f = 0; f < scene.frames.size(); ++f) {
    const Frame& frame = scene.frames[f];
    for (int r = 0; r < repetitions; ++r) {
      const bool from_front = traversal.has_front();
      do {
        ++totals.growths;
        launch(traversal, device.nodes(f), from_front, how, stream);
        traversal.read_counters(stream);
        LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
      } while (traversal.grow(stream));
      --totals.growths;
      const TraversalCounters& c = traversal.counters();
      totals.steals += c.steals;
      totals.overflows += c.overflows;
      expect(equal(download(traversal.leaf_pairs(), c.leaf_pairs), frame.leaf_pairs), "leaf pairs",
             scene, f, options);
      if (options.algorithm.strategy == Strategy::thread_per_query) continue;
      const Walk& walk = from_front ? frame.from_front : frame.from_root;
      expect(c.tree_tests == walk.tests, "number of tests", scene, f, options);
      expect(c.front_nodes == walk.front.size(), "size of the front", scene, f, options);
      if (options.algorithm.front == FrontUse::on)
        expect(equal(download(traversal.front(), c.front_nodes), walk.front), "front", scene, f,
               options);
    }
    traversal.accept();
  }
}

// As check(), with culling by oriented boxes and flat nodes. Checks the counters too.
void check_culling(DeviceScene& device, const DetectorOptions& options, int repetitions,
                   const Stream& stream) {
  const Scene& scene = device.scene();
  Traversal traversal(options);
  traversal.reset(device.node_count(), stream);
  for (std::size_t f = 0; f < scene.frames.size(); ++f) {
    const Frame& frame = scene.frames[f];
    const gpu::NodeCulling culling = device.culling(f);
    for (int r = 0; r < repetitions; ++r) {
      const bool from_front = traversal.has_front();
      gpu::research::CullingCounters culled;
      do {
        LAZYCCD_CUDA_CHECK(
            cudaMemsetAsync(culling.counters, 0, sizeof(gpu::research::CullingCounters), stream));
        run(traversal, device.nodes(f), from_front, stream, &culling);
        traversal.read_counters(stream);
        LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(&culled, culling.counters, sizeof culled,
                                           cudaMemcpyDeviceToHost, stream));
        LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
      } while (traversal.grow(stream));
      const TraversalCounters& c = traversal.counters();
      const auto leaf_pairs = download(traversal.leaf_pairs(), c.leaf_pairs);
      if (options.algorithm.strategy == Strategy::thread_per_query) {
        expect(equal(leaf_pairs, frame.queried_leaf_pairs), "leaf pairs", scene, f, options);
        continue;
      }
      const Walk& walk = from_front ? frame.culled_from_front : frame.culled_from_root;
      expect(equal(leaf_pairs, walk.leaf_pairs), "leaf pairs with culling", scene, f, options);
      expect(c.tree_tests == walk.tests, "number of tests with culling", scene, f, options);
      expect(culled.culled_by_volume == walk.culled_by_volume, "pairs culled", scene, f, options);
      expect(culled.culled_by_normal_cone == walk.culled_by_normal_cone, "flat nodes", scene, f,
             options);
      if (options.algorithm.front == FrontUse::on)
        expect(equal(download(traversal.front(), c.front_nodes), walk.front), "front with culling",
               scene, f, options);
    }
    traversal.accept();
  }
}

void check_culling(std::vector<DeviceScene>& scenes, const Stream& stream) {
  const int before = failures;
  for (const Strategy strategy : kStrategies) {
    for (const FrontUse front : {FrontUse::off, FrontUse::on}) {
      for (const int block_size : {0, 64}) {
        DetectorOptions options;
        options.algorithm.strategy = strategy;
        options.algorithm.front = front;
        options.algorithm.volume = Volume::oriented_box;
        options.algorithm.tuning.block_size = block_size;
        options.algorithm.tuning.capacity_hint = block_size == 64 ? 1 : 0;
        for (DeviceScene& scene : scenes) check_culling(scene, options, 2, stream);
      }
    }
  }
  std::printf("%s culling of nodes\n", failures == before ? "PASS" : "FAIL");
}

void check_all(const std::vector<DeviceScene>& scenes, DetectorOptions options, int repetitions,
               const Stream& stream, Launch how = Launch::direct) {
  const int before = failures;
  const auto begin = std::chrono::steady_clock::now();
  Totals totals;
  for (const DeviceScene& scene : scenes) check(scene, options, repetitions, how, totals, stream);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
  std::printf("%s %s%s: %llu steals, %llu overflows, %llu growths, %.0f ms\n",
              failures == before ? "PASS" : "FAIL", describe(options).c_str(),
              how == Launch::graph ? ", graph" : "", static_cast<unsigned long long>(totals.steals),
              static_cast<unsigned long long>(totals.overflows),
              static_cast<unsigned long long>(totals.growths), time.count());
  std::fflush(stdout);
}

// Runs two traversals at the same time, each on its own stream.
void check_two_at_once(const DeviceScene& one, const DeviceScene& two, int repetitions) {
  const int before = failures;
  DetectorOptions options;
  const DeviceScene* scenes[2] = {&one, &two};
  Stream streams[2];
  Traversal traversals[2] = {Traversal(options), Traversal(options)};
  for (int i = 0; i < 2; ++i) traversals[i].reset(scenes[i]->node_count(), streams[i]);
  for (int r = 0; r < repetitions; ++r) {
    for (int i = 0; i < 2; ++i) {
      run(traversals[i], scenes[i]->nodes(0), false, streams[i]);
      traversals[i].read_counters(streams[i]);
    }
    for (int i = 0; i < 2; ++i) {
      LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(streams[i]));
      const Scene& scene = scenes[i]->scene();
      expect(!traversals[i].grow(streams[i]), "room at the first try", scene, 0, options);
      expect(equal(download(traversals[i].leaf_pairs(), traversals[i].counters().leaf_pairs),
                   scene.frames[0].leaf_pairs),
             "leaf pairs, two at once", scene, 0, options);
    }
  }
  std::printf("%s two traversals at once\n", failures == before ? "PASS" : "FAIL");
}

void check_refusals(const DeviceScene& deep) {
  const int before = failures;
  const auto refused = [](ErrorCode code, const auto& action) {
    try {
      action();
    } catch (const Error& error) {
      if (error.code() == code) return;
    }
    ++failures;
    std::printf("FAIL something was not refused\n");
  };
  const auto with = [](Strategy strategy, int block_size, int chunk) {
    DetectorOptions options;
    options.algorithm.strategy = strategy;
    options.algorithm.tuning.block_size = block_size;
    options.algorithm.tuning.chunk = chunk;
    return options;
  };
  for (const Strategy s : kStrategies)
    refused(ErrorCode::invalid_argument, [&] { Traversal traversal(with(s, 48, 0)); });
  refused(ErrorCode::invalid_argument, [&] { Traversal t(with(Strategy::lazy_stealing, 0, 33)); });
  refused(ErrorCode::invalid_argument, [&] {
    Stream stream;
    Traversal traversal(with(Strategy::lazy_stealing, 0, 0));
    traversal.reset(deep.node_count(), stream);
    run(traversal, deep.nodes(0), true, stream);
  });
  // The tree is too deep for the stack of a thread.
  refused(ErrorCode::device, [&] {
    Stream stream;
    Traversal traversal(with(Strategy::thread_per_query, 0, 0));
    traversal.reset(deep.node_count(), stream);
    run(traversal, deep.nodes(0), false, stream);
    traversal.read_counters(stream);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
    traversal.grow(stream);
  });
  std::printf("%s refusals\n", failures == before ? "PASS" : "FAIL");
}

// Prints the median duration of a launch between two events, microseconds.
void time_launches(const DeviceScene& device, const DetectorOptions& options, bool from_front) {
  constexpr int runs = 21;
  Stream stream;
  Traversal traversal(options);
  traversal.reset(device.node_count(), stream);
  cudaEvent_t begin, end;
  LAZYCCD_CUDA_CHECK(cudaEventCreate(&begin));
  LAZYCCD_CUDA_CHECK(cudaEventCreate(&end));
  std::vector<float> times;
  for (int i = 0; i < runs + 2; ++i) {
    bool again = true;
    while (again) {
      LAZYCCD_CUDA_CHECK(cudaEventRecord(begin, stream));
      run(traversal, device.nodes(0), from_front && traversal.has_front(), stream);
      LAZYCCD_CUDA_CHECK(cudaEventRecord(end, stream));
      traversal.read_counters(stream);
      LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
      again = traversal.grow(stream);
    }
    traversal.accept();
    float ms = 0;
    LAZYCCD_CUDA_CHECK(cudaEventElapsedTime(&ms, begin, end));
    if (i >= 2) times.push_back(1000 * ms);
  }
  std::sort(times.begin(), times.end());
  const TraversalCounters& c = traversal.counters();
  std::printf(
      "TIME %7.1f us: scene %s, %s, %s; %u leaf pairs, %u ended, %llu tests, %llu steals, idle "
      "%.2f\n",
      times[runs / 2], device.scene().name.c_str(), from_front ? "from front" : "from root",
      describe(options).c_str(), c.leaf_pairs, c.front_nodes,
      static_cast<unsigned long long>(c.tree_tests), static_cast<unsigned long long>(c.steals),
      traversal.idle_share());
  LAZYCCD_CUDA_CHECK(cudaEventDestroy(begin));
  LAZYCCD_CUDA_CHECK(cudaEventDestroy(end));
}

void check_everything(int repetitions) {
  std::vector<Scene> scenes;
  for (const std::uint32_t groups : {0u, 1u, 2u, 3u, 17u, 64u})
    scenes.push_back(make_scene(std::to_string(groups) + " groups", groups, 0.4f, 2));
  scenes.push_back(make_scene("300 groups", 300, 0.15f, 4));
  scenes.push_back(make_scene("3000 groups", 3000, 0.06f, 3));
  scenes.push_back(make_scene("all overlap", 300, 3.f, 2));
  scenes.push_back(make_scene("a chain to the right", 400, 0.5f, 2, Shape::right_chain));
  // Deeper than the reserve of a block's stack when it is nearly full.
  const Scene deep = make_scene("a deep chain", 400, 1.f, 2, Shape::left_chain);
  const Scene large = make_scene("like a cloth", 6000, 0.05f, 1);

  std::vector<DeviceScene> devices;
  for (const Scene& scene : scenes) devices.emplace_back(scene);
  std::vector<DeviceScene> deep_devices;
  deep_devices.emplace_back(deep);
  const DeviceScene large_device(large);
  const Stream stream;

  const auto with = [](Strategy strategy, FrontUse front, Tuning tuning) {
    DetectorOptions options;
    options.algorithm.strategy = strategy;
    options.algorithm.front = front;
    options.algorithm.tuning = tuning;
    return options;
  };
  const auto tuned = [](int block_size, int blocks, int chunk, std::uint32_t capacity, int delay) {
    Tuning tuning;
    tuning.block_size = block_size;
    tuning.blocks = blocks;
    tuning.chunk = chunk;
    tuning.capacity_hint = capacity;
    tuning.delay_ns = delay;
    return tuning;
  };
  constexpr Strategy persistent[] = {Strategy::lazy_stealing, Strategy::lazy_stealing_greedy,
                                     Strategy::static_list, Strategy::task_stealing,
                                     Strategy::guided};
  for (const Strategy strategy : persistent) {
    for (const FrontUse front : {FrontUse::off, FrontUse::on}) {
      const auto check_with = [&](const std::vector<DeviceScene>& some, Tuning tuning, int times,
                                  Launch how = Launch::direct) {
        check_all(some, with(strategy, front, tuning), times, stream, how);
      };
      check_with(devices, tuned(0, 0, 0, 0, 0), repetitions);
      check_with(devices, tuned(0, 0, 0, 0, 0), 2, Launch::graph);
      for (const int block_size : {32, 64, 128, 512}) {
        if (strategy == Strategy::lazy_stealing)
          for (const int chunk : {32, 128})
            check_with(devices, tuned(block_size, 0, chunk, 0, 0), 1);
        check_with(devices, tuned(block_size, 0, 0, 0, 0), 1);
      }
      // The last number is more blocks than any device runs at a time.
      for (const int blocks : {1, 2, 7, 6000}) {
        check_with(devices, tuned(0, blocks, 0, 0, 0), 1);
        check_with(devices, tuned(64, blocks, 32, 1, 0), 1);
      }
      for (const int delay : {200, 5000}) {
        check_with(devices, tuned(64, 264, 32, 0, delay), 2);
        check_with(devices, tuned(32, 64, 32, 3, delay), 2);
        check_with(devices, tuned(256, 0, 256, 0, delay), 2);
      }
      check_with(devices, tuned(0, 0, 0, 1, 0), 2);
      check_with(devices, tuned(512, 0, 32, 1, 0), 2);
      check_with(deep_devices, tuned(0, 0, 0, 0, 0), 2);
      check_with(deep_devices, tuned(64, 1, 32, 1, 0), 2);
      check_with(deep_devices, tuned(64, 40, 32, 1, 1000), 2);
    }
  }
  for (const int block_size : {0, 32, 256, 512}) {
    const auto query = [&](Tuning tuning) {
      return with(Strategy::thread_per_query, FrontUse::on, tuning);
    };
    check_all(devices, query(tuned(block_size, 0, 0, 0, 0)), 2, stream);
    check_all(devices, query(tuned(block_size, 1, 0, 1, 500)), 2, stream);
  }
  check_culling(devices, stream);
  check_two_at_once(devices[6], devices[7], repetitions);
  check_refusals(deep_devices[0]);

  for (const bool from_front : {false, true}) {
    const FrontUse front = from_front ? FrontUse::on : FrontUse::off;
    for (const Strategy strategy : persistent)
      time_launches(large_device, with(strategy, front, Tuning{}), from_front);
    for (const int block_size : {128, 256, 512})
      time_launches(large_device,
                    with(Strategy::lazy_stealing, front, tuned(block_size, 0, 0, 0, 0)),
                    from_front);
  }
  time_launches(large_device, with(Strategy::thread_per_query, FrontUse::off, Tuning{}), false);
}

}  // namespace
}  // namespace lazyccd::test

int main(int argc, char** argv) {
  lazyccd::register_research();
  int count = 0;
  if (cudaGetDeviceCount(&count) != cudaSuccess || count == 0) {
    std::printf("SKIPPED: no CUDA device\n");
    return 77;
  }
  const int repetitions = argc > 1 ? std::atoi(argv[1]) : 20;
  try {
    lazyccd::test::check_everything(repetitions);
  } catch (const std::exception& error) {
    std::printf("FAIL %s\n", error.what());
    return 1;
  }
  std::printf("%s\n", lazyccd::test::failures == 0 ? "ALL PASSED" : "SOME FAILED");
  return lazyccd::test::failures == 0 ? 0 : 1;
}
