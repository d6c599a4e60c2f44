// Compares edges and cells that the device finds with those of the host, to the bit; then what
// happens to a topology that is invalid. Prints the times of both.
//
//   check_topology [--small | --large]
//
// --small: small scenes, for the sanitizers. --large: sheets of 2 and 20 million faces too.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "device_probe.h"
#include "gpu/device/stream.h"
#include "gpu/scene/device_scene.h"
#include "gpu/topology/topology_builder.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "report.h"
#include "support/build_scenes.h"

namespace {

using namespace lazyccd;
using test::BuildScene;

// Whether `count` items on the device equal those at `expected`.
template <class T>
bool same(const T* device, const void* expected, std::size_t count) {
  std::vector<T> items(count);
  if (count == 0) return true;
  LAZYCCD_CUDA_CHECK(cudaMemcpy(items.data(), device, count * sizeof(T), cudaMemcpyDeviceToHost));
  return std::memcmp(items.data(), expected, count * sizeof(T)) == 0;
}

template <class F>
double least_ms(int repeat, F&& f) {
  double least = 1e30;
  for (int i = 0; i < repeat; ++i) {
    const auto start = std::chrono::steady_clock::now();
    f();
    least = std::min(
        least, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                   .count());
  }
  return least;
}

// Finds a topology on the device for Mesh.
struct Finder : TopologyFinder {
  gpu::DeviceScene scene{0, false};
  gpu::TopologyBuilder builder;
  gpu::Stream stream;
  ThreadPool& pool;

  explicit Finder(ThreadPool& threads) : pool(threads) {}
  FoundTopology find(const TopologyInput& input) override {
    return builder.build(input, scene, pool, stream);
  }
};

// Returns what differs first; empty: nothing.
std::string difference(const Mesh& host, const Mesh& found, gpu::DeviceMesh& device) {
  const auto& cells = host.cells().primitives();
  std::vector<std::int32_t> numbers(cells.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<std::int32_t>(i);
  if (found.edge_count() != host.edges().size()) return "the number of edges";
  if (!same(device.faces.data(), host.faces().data(), host.faces().size())) return "faces";
  if (!same(device.edges.data(), host.edges().data(), host.edges().size())) return "edges";
  if (!same(device.face_edges.data(), host.face_edges().data(), 3 * host.faces().size()))
    return "edges of faces";
  if (!same(device.body_of_vertex.data(), host.body_of_vertex().data(), host.vertex_count()))
    return "bodies of vertices";
  if (device.has_primitives ? !same(device.primitives.data(), cells.data(), cells.size())
                            : !std::equal(numbers.begin(), numbers.end(), cells.begin()))
    return "cells";
  const auto &a = host.cells().segments(), &b = found.cells().segments();
  if (a.size() != b.size() || std::memcmp(a.data(), b.data(), a.size() * sizeof(CellSegment)) != 0)
    return "segments";
  return {};
}

void check_found(const BuildScene& scene, Finder& finder) {
  const Topology topology = scene.topology();
  const Mesh host(topology, finder.pool);
  Mesh found(topology, finder.pool, &finder);
  const bool was_complete = found.is_complete();
  const std::string differs = difference(host, found, finder.scene.mesh());
  found.complete(finder.pool);
  const bool completes =
      !was_complete && found.edges().size() == host.edges().size() &&
      std::equal(host.edges().begin(), host.edges().end(), found.edges().begin()) &&
      found.cells().segments().size() == host.cells().segments().size();
  const std::string name = scene.name + ", " + std::to_string(scene.faces.size()) + " faces, " +
                           std::to_string(scene.edges.size()) + " edges";
  report(differs.empty() && completes, name + ": " +
                                           (!differs.empty() ? differs + " differ"
                                            : completes      ? "same"
                                                             : "incomplete"));
  if (scene.faces.size() < 100000) return;
  Mesh reused;
  const double host_ms = least_ms(3, [&] { reused = Mesh(topology, finder.pool); });
  const double device_ms = least_ms(3, [&] { reused = Mesh(topology, finder.pool, &finder); });
  std::printf("TIME  %s: mesh by the device %.3f ms, by the host %.3f ms, %d threads\n",
              name.c_str(), device_ms, host_ms, finder.pool.size());
}

BuildScene sheet(int n) {
  BuildScene scene;
  scene.name = "sheet";
  scene.add_sheet(n, 0, 1, 0);
  return scene;
}

// Random faces and edges, with edges of many faces, bodies and worlds in no order.
BuildScene random_scene(std::uint32_t seed) {
  BuildScene scene;
  scene.name = "random " + std::to_string(seed);
  std::mt19937 random(seed);
  const auto below = [&](std::size_t n) { return static_cast<std::int32_t>(random() % n); };
  const std::int32_t bodies = 1 + below(6), vertices = 4 + below(8);
  for (std::int32_t v = 0; v < bodies * vertices; ++v) scene.add_vertex(v, 0, 0, v % bodies);
  for (std::int32_t b = 0; b < bodies; ++b) {
    scene.bodies.emplace_back();
    scene.bodies.back().world = seed % 3 == 0 ? 0 : below(4) - 1;
  }
  const auto vertex = [&](std::int32_t body) { return body + bodies * below(vertices); };
  std::vector<Face> sorted;
  for (std::int32_t i = 0; i < 40 * bodies; ++i) {
    const std::int32_t body = i < bodies ? i : below(bodies);
    Face f{vertex(body), vertex(body), vertex(body)};
    if (i < bodies) f = {body, body + bodies, body + 2 * bodies};
    Face key = f;
    std::sort(key.begin(), key.end());
    if (key[0] == key[1] || key[1] == key[2]) continue;
    if (std::find(sorted.begin(), sorted.end(), key) != sorted.end()) continue;
    sorted.push_back(key);
    scene.faces.push_back(f);
    const Edge e{vertex(body), vertex(body)};
    if (seed % 2 == 0 && e[0] != e[1]) scene.edges.push_back(e);
  }
  return scene;
}

// A topology that is refused leaves the old one in use, on the device too.
void check_refused() {
  DetectorOptions options;
  options.backend = Backend::cuda;
  Detector cuda(options);
  options.backend = Backend::cpu;
  Detector cpu(options);
  BuildScene good = sheet(20);
  good.add_sheet(20, 1, 1, 0.01);
  std::vector<double> end = good.x;
  for (std::size_t i = 3 * 21 * 21 + 2; i < end.size(); i += 3) end[i] -= 0.03;
  const Positions from(good.x.data(), good.x.size() / 3), to(end.data(), end.size() / 3);
  for (Detector* detector : {&cuda, &cpu}) detector->set_topology(good.topology());
  cpu.detect(from, to);
  const auto refuses = [&](const BuildScene& bad, ErrorCode code, const char* what) {
    bool refused = false;
    try {
      cuda.set_topology(bad.topology());
    } catch (const Error& error) {
      refused = error.code() == code;
    }
    cuda.detect(from, to);
    const bool same_as_before = cuda.stats().backend == "cuda" &&
                                cuda.stats().hash == cpu.stats().hash &&
                                cuda.edges().size() == cpu.edges().size();
    report(refused && same_as_before && cpu.stats().contacts_ee > 0,
           std::string("refused, and the old topology stays: ") + what);
  };
  BuildScene bad = sheet(30);
  bad.faces.push_back({bad.faces[7][1], bad.faces[7][2], bad.faces[7][0]});
  refuses(bad, ErrorCode::duplicate_face, "a face twice");
  bad.faces.back() = {0, 1, 1};
  refuses(bad, ErrorCode::degenerate_face, "a vertex twice");
  bad.faces.back() = {0, 1, 100000};
  refuses(bad, ErrorCode::index_out_of_range, "a vertex that is not there");
  bad.faces.back() = {0, 1, -1};
  refuses(bad, ErrorCode::index_out_of_range, "a negative vertex");
  bad.faces.pop_back();
  bad.add_vertex(0, 0, 1, 1);
  refuses(bad, ErrorCode::empty_body, "a body without faces");
  bad.faces.push_back({0, 1, static_cast<std::int32_t>(bad.body_of_vertex.size()) - 1});
  refuses(bad, ErrorCode::mixed_body, "a face of two bodies");
  bad.faces.pop_back();
  bad.edges.push_back({3, 3});
  refuses(bad, ErrorCode::degenerate_face, "an edge between a vertex and itself");
  // Other topologies, and the old one again.
  bool good_again = true;
  for (const int n : {5, 40, 20}) {
    BuildScene other = sheet(n);
    other.add_sheet(n, 1, 1, 0.01);
    std::vector<double> moved = other.x;
    for (std::size_t i = 2; i < moved.size(); i += 3) moved[i] -= i < moved.size() / 2 ? 0 : 0.03;
    for (Detector* detector : {&cuda, &cpu}) {
      detector->set_topology(other.topology());
      detector->detect({other.x.data(), other.x.size() / 3}, {moved.data(), moved.size() / 3});
    }
    good_again = good_again && cuda.stats().hash == cpu.stats().hash &&
                 cuda.stats().backend == "cuda" && cpu.stats().contacts_vf > 0;
  }
  report(good_again, "one topology after another");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string option = argc > 1 ? argv[1] : "";
  const bool small = option == "--small", large = option == "--large";
  if (skips_without_cuda()) return kSkipped;
  try {
    ThreadPool pool(0);
    Finder finder(pool);
    for (std::uint32_t seed = 0; seed < (small ? 4u : 60u); ++seed)
      check_found(random_scene(seed), finder);
    std::vector<BuildScene> scenes;
    if (!small) scenes = test::build_scenes();
    for (const int n : {1, 2, 25}) scenes.push_back(sheet(n));
    if (!small) scenes.push_back(sheet(313));
    for (const BuildScene& scene : scenes) check_found(scene, finder);
    for (BuildScene& scene : scenes) {
      scene.name += ", shuffled";
      scene.shuffle_faces();
      check_found(scene, finder);
    }
    if (large)
      for (const int n : {1000, 3162}) check_found(sheet(n), finder);
    check_refused();
  } catch (const std::exception& error) {
    report(false, error.what());
  }
  std::printf("%d failed\n", failures);
  return failures == 0 ? 0 : 1;
}
