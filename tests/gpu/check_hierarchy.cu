// Compares the hierarchy that the device builds with that of the host, to the bit: groups, what
// they own, tree. Then the contacts of both backends, with a rebuild in every step. Prints the
// times of both builds.
//
//   check_hierarchy [--small | --large]
//
// --small: small scenes, for the sanitizers. --large: sheets of 2 and 20 million faces too.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "device_probe.h"
#include "gpu/bvh/hierarchy_builder.h"
#include "gpu/device/stream.h"
#include "gpu/scene/device_scene.h"
#include "gpu/scene/packed_positions.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "report.h"
#include "support/build_scenes.h"

namespace {

using namespace lazyccd;
using test::BuildScene;

template <class T>
std::vector<T> download(const T* from, std::size_t count) {
  std::vector<T> items(count);
  if (count != 0)
    LAZYCCD_CUDA_CHECK(cudaMemcpy(items.data(), from, count * sizeof(T), cudaMemcpyDeviceToHost));
  return items;
}

// A hierarchy as it lies on the device.
struct Built {
  std::vector<gpu::DeviceGroup> groups;
  std::vector<gpu::PrimitiveNames> names;
  std::vector<std::int32_t> leaf_order;
  std::vector<int2> node_ranges;
  std::vector<TreeNode> nodes;

  explicit Built(const gpu::SceneView& view)
      : groups(download(view.groups.groups, view.group_count)),
        leaf_order(download(view.leaf_order, view.group_count)),
        node_ranges(download(view.node_ranges, view.node_count)),
        nodes(download<TreeNode>(view.nodes, view.node_count)) {
    if (groups.empty()) return;
    const gpu::DeviceGroup& last = groups.back();
    names = download<gpu::PrimitiveNames>(
        view.groups.names, static_cast<std::size_t>(last.first_place + last.places()));
  }
};

// Returns what differs first; empty: nothing.
std::string difference(const Built& a, const Built& b) {
  const auto at = [](const char* what, std::size_t i) { return what + std::to_string(i); };
  if (a.groups.size() != b.groups.size() || a.names.size() != b.names.size())
    return "the number of groups or blocks";
  for (std::size_t g = 0; g < a.groups.size(); ++g) {
    const gpu::DeviceGroup &x = a.groups[g], &y = b.groups[g];
    if (x.body != y.body || x.first_place != y.first_place ||
        !std::equal(x.count, x.count + 3, y.count) || x.pinned != y.pinned ||
        x.meets_own_body != y.meets_own_body)
      return at("group ", g);
    const std::size_t first = static_cast<std::size_t>(x.first_place);
    if (std::memcmp(&a.names[first], &b.names[first],
                    static_cast<std::size_t>(x.total()) * sizeof(gpu::PrimitiveNames)) != 0)
      return at("a primitive of group ", g);
  }
  for (std::size_t i = 0; i < a.leaf_order.size(); ++i)
    if (a.leaf_order[i] != b.leaf_order[i]) return at("place in the leaf order ", i);
  for (std::size_t i = 0; i < a.nodes.size(); ++i) {
    if (a.nodes[i].left != b.nodes[i].left || a.nodes[i].right_link != b.nodes[i].right_link)
      return at("children of node ", i);
    if (a.node_ranges[i].x != b.node_ranges[i].x || a.node_ranges[i].y != b.node_ranges[i].y)
      return at("leaves of node ", i);
  }
  return {};
}

template <class F>
double median_ms(int repeat, F&& f) {
  std::vector<double> times;
  for (int i = 0; i < repeat; ++i) {
    const auto start = std::chrono::steady_clock::now();
    f();
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

// Milliseconds of the build on the device: launched as one graph, by events.
double time_on_device(gpu::HierarchyBuilder& builder, const gpu::PackedPositions& positions,
                      const gpu::Stream& stream) {
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  LAZYCCD_CUDA_CHECK(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
  builder.enqueue(positions.start(), positions.is_double(), stream);
  LAZYCCD_CUDA_CHECK(cudaStreamEndCapture(stream, &graph));
  LAZYCCD_CUDA_CHECK(cudaGraphInstantiate(&executable, graph, 0));
  gpu::Event begin, end;
  std::vector<double> times;
  for (int i = 0; i < 21; ++i) {
    begin.record(stream);
    LAZYCCD_CUDA_CHECK(cudaGraphLaunch(executable, stream));
    end.record(stream);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
    times.push_back(end.since(begin));
  }
  static_cast<void>(cudaGraphExecDestroy(executable));
  static_cast<void>(cudaGraphDestroy(graph));
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

Positions at(const std::vector<double>& x) { return {x.data(), x.size() / 3}; }

// The positions after a motion that is as small as the faces of a large sheet.
std::vector<double> moved(std::vector<double> x, bool in_float) {
  const double most = std::min(0.002, 400.0 / static_cast<double>(x.size()));
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] += most * (static_cast<double>(i * 7919 % 101) / 50 - 1);
    if (in_float) x[i] = static_cast<float>(x[i]);
  }
  return x;
}

void check_build(const BuildScene& scene, bool in_float) {
  std::vector<double> start = scene.x;
  for (double& x : start) x = in_float ? static_cast<float>(x) : x + 1e-12;
  const std::vector<double> end = moved(start, in_float);
  ThreadPool pool(0);
  Mesh mesh;
  const double mesh_ms = median_ms(3, [&] { mesh = Mesh(scene.topology(), pool); });
  gpu::Stream stream;
  gpu::PackedPositions positions;
  positions.upload(at(start), at(end), pool, stream);
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
  const std::string name = scene.name + ", " + std::to_string(mesh.faces().size()) + " faces, " +
                           (positions.is_double() ? "double" : "float");
  std::string differs;
  double device_ms = 0, host_ms = 0;
  {
    gpu::DeviceScene on_host(0, false), on_device(0, false);
    on_host.set_mesh(mesh);
    on_device.set_mesh(mesh);
    const auto build = [&] {
      on_host.build_on_host(at(start), at(end), pool);
      LAZYCCD_CUDA_CHECK(cudaDeviceSynchronize());
    };
    const bool is_huge = mesh.faces().size() > 5000000;  // gigabytes to copy and seconds to build
    host_ms = median_ms(is_huge ? 1 : 4, build);
    const Built truth(on_host.view(positions.is_double()));
    on_device.prepare();
    gpu::HierarchyBuilder builder;
    builder.set_mesh(mesh, on_device);
    for (int repeat = 0; repeat < (is_huge ? 1 : 3) && differs.empty(); ++repeat) {
      builder.enqueue(positions.start(), positions.is_double(), stream);
      LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
      differs = difference(truth, Built(on_device.view(positions.is_double())));
    }
    device_ms = time_on_device(builder, positions, stream);
    if (differs.empty()) {
      differs = difference(truth, Built(on_device.view(positions.is_double())));
      if (!differs.empty()) differs += ", launched as a graph";
    }
  }
  report(differs.empty(),
         name + ", hierarchy: " + (differs.empty() ? "same" : differs + " differs"));
  std::printf("TIME  %s: device %.3f ms; host with upload %.2f ms, mesh %.2f ms, %d threads\n",
              name.c_str(), device_ms, host_ms, mesh_ms, pool.size());
}

// Checks the contacts of a few steps, and times steps and a new topology.
void check_contacts(const BuildScene& scene, bool with_cpu) {
  std::vector<std::vector<double>> frames{scene.x};
  for (double& x : frames[0]) x = static_cast<float>(x);
  for (int i = 0; i < 3; ++i) frames.push_back(moved(frames.back(), true));
  DetectorOptions options;
  options.algorithm.rebuild_every_step = true;
  options.backend = Backend::cuda;
  Detector cuda(options);
  options.backend = Backend::cpu;
  Detector cpu(options);
  std::vector<Body> bodies(static_cast<std::size_t>(
      *std::max_element(scene.body_of_vertex.begin(), scene.body_of_vertex.end()) + 1));
  for (Body& body : bodies) body.self_collision = true;
  Topology topology = scene.topology();
  topology.bodies = bodies;
  cuda.set_topology(topology);
  if (with_cpu) cpu.set_topology(topology);
  bool good = true;
  std::int64_t contacts = 0;
  double step_ms = 0, upload_ms = 0, device_ms = 0;
  for (std::size_t f = 0; f + 1 < frames.size(); ++f) {
    cuda.detect(at(frames[f]), at(frames[f + 1]));
    const Stats& stats = cuda.stats();
    good = good && stats.backend == "cuda" && stats.rebuilt;
    step_ms = stats.ms_total, upload_ms = stats.ms_upload, device_ms = stats.ms_device;
    contacts += stats.contacts_vf + stats.contacts_ee;
    if (!with_cpu) continue;
    cpu.detect(at(frames[f]), at(frames[f + 1]));
    good = good && stats.hash == cpu.stats().hash && stats.contacts_vf == cpu.stats().contacts_vf &&
           stats.contacts_ee == cpu.stats().contacts_ee;
  }
  report(good, scene.name +
                   ", contacts of both backends, rebuilt each step: " + std::to_string(contacts));
  const double topology_ms = median_ms(3, [&] {
    cuda.set_topology(topology);
    cuda.detect(at(frames[0]), at(frames[1]));
  });
  std::printf(
      "TIME  %s: last step with rebuild %.3f ms, of that upload %.3f and step on the device %.3f; "
      "new topology and detection %.2f ms\n",
      scene.name.c_str(), step_ms, upload_ms, device_ms, topology_ms);
}

BuildScene sheet(int n, bool shuffled) {
  BuildScene scene;
  scene.name =
      std::string(shuffled ? "shuffled sheet of " : "sheet of ") + std::to_string(2 * n * n);
  scene.add_sheet(n, 0, 1, 0);
  if (shuffled) scene.shuffle_faces();
  return scene;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string option = argc > 1 ? argv[1] : "";
  const bool small = option == "--small", large = option == "--large";
  if (skips_without_cuda()) return kSkipped;
  try {
    std::vector<BuildScene> scenes;
    if (!small) scenes = test::build_scenes();
    for (const int n : {1, 2, 3, 4, 7, 25, 98}) scenes.push_back(sheet(n, false));
    scenes.push_back(sheet(60, true));
    if (!small)
      for (const int n : {221, 313}) {
        scenes.push_back(sheet(n, false));
        scenes.push_back(sheet(n, true));
      }
    if (large) scenes.push_back(sheet(1000, false));
    for (const BuildScene& scene : scenes) {
      for (const bool in_float : {true, false}) check_build(scene, in_float);
      // Where all faces lie in one place there are too many pairs for a quick check.
      if (scene.name != "all centroids equal") check_contacts(scene, scene.faces.size() < 1000000);
    }
    if (large) {
      const BuildScene huge = sheet(3162, false);
      check_build(huge, true);
      check_contacts(huge, false);
    }
  } catch (const std::exception& error) {
    report(false, error.what());
  }
  std::printf("%d failed\n", failures);
  return failures == 0 ? 0 : 1;
}
