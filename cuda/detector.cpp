// The public Detector: uses the chosen backend in each step, and falls back from the GPU to the
// CPU.
#include "lazyccd/detector.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backend_choice.h"
#include "core/ieee_arithmetic.h"
#include "core/narrow/contact_math.h"
#include "cpu/cpu_detector.h"
#include "host/scene/column_copy.h"
#include "host/scene/world_contacts.h"
#include "lazyccd/debug/assert.h"
#include "lazyccd/debug/stopwatch.h"
#include "lazyccd/error.h"
#if defined(LAZYCCD_HAS_CUDA)
#include "gpu/gpu_detector.h"
#endif

namespace lazyccd {
namespace {

std::unique_ptr<DeviceBackend> make_gpu(const DetectorOptions& options, ThreadPool& threads) {
#if defined(LAZYCCD_HAS_CUDA)
  return make_gpu_detector(options, threads);
#else
  static_cast<void>(options);
  static_cast<void>(threads);
  throw Error(ErrorCode::unavailable, "this build has no CUDA backend");
#endif
}

// Whether contacts are in the detector's order, none twice.
bool are_sorted(Span<const Contact> contacts, const Mesh& mesh) {
  const ContactOrder is_before = mesh.contact_order();
  return std::adjacent_find(contacts.begin(), contacts.end(),
                            [&](const Contact& a, const Contact& b) { return !is_before(a, b); }) ==
         contacts.end();
}

// Whether contacts name bodies, primitives and vertices of the mesh.
bool are_of(Span<const Contact> contacts, const Mesh& mesh) {
  const auto is_below = [](std::int32_t i, std::size_t count) {
    return i >= 0 && static_cast<std::size_t>(i) < count;
  };
  return std::all_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
    const bool is_vertex_face = c.kind == ContactKind::vertex_face;
    if (!is_below(c.primitive_a, is_vertex_face ? mesh.vertex_count() : mesh.edge_count()) ||
        !is_below(c.primitive_b, is_vertex_face ? mesh.faces().size() : mesh.edge_count()))
      return false;
    for (int i = 0; i < 4; ++i) {
      const std::int32_t v = c.vertices[i];
      if (!is_below(v, mesh.vertex_count()) ||
          mesh.body_of_vertex()[v] != (i < first_vertex_of_b(c.kind) ? c.body_a : c.body_b))
        return false;
    }
    return true;
  });
}

// Whether contacts happen within the step.
bool are_in_step(Span<const Contact> contacts) {
  return std::all_of(contacts.begin(), contacts.end(),
                     [](const Contact& c) { return c.toi >= 0 && c.toi <= 1; });
}

}  // namespace

struct Detector::Impl {
  Impl(const DetectorOptions& o, const Threads& t) : options(o), threads(t), cpu(o, t) {
    if (options.backend == Backend::cuda) start_gpu();
  }

  // After a failure the device is restarted for the next step, up to this number of times. Another
  // program may have caused the failure (out of memory), or it may have destroyed the context.
  static constexpr int max_failures = 3;

  // Whether the GPU may be used, if there is one.
  bool may_start_gpu() const { return options.backend != Backend::cpu && failures < max_failures; }

  // Backend of the next detection.
  Backend next() const {
    if (!may_start_gpu()) return Backend::cpu;
    return options.backend == Backend::automatic ? choice.next() : Backend::cuda;
  }

  // Starts the GPU if it is not running, and gives it the mesh if it lacks that.
  void start_gpu() {
    try {
      if (!gpu) {
        gpu_has_mesh = false;
        gpu = make_gpu(options, threads.pool());
      }
      if (!gpu_has_mesh) gpu->set_mesh(mesh);
      gpu_has_mesh = true;
    } catch (const Error& error) {
      gpu_failed(error);
    }
  }

  void gpu_failed(const Error& error) {
    gpu.reset();
    gpu_has_near_pairs = false;
    failures = error.code() == ErrorCode::unavailable ? max_failures : failures + 1;
    // On a machine without a device, Backend::automatic means the CPU, and there is nothing to
    // report.
    if (options.backend == Backend::cuda || error.code() != ErrorCode::unavailable)
      reason = error.what();
  }

  void set_mesh() {
    worlds.set_mesh(mesh);
    cpu.set_mesh(mesh);
  }

  void set_topology(const Topology& topology) {
    is_from_cpu = gpu_has_near_pairs = false;
    refusal.clear();
    const BackendChoice last_choice = choice;
    choice.set_scene(topology.faces.size());
    try {
      find_mesh(topology);
    } catch (const Error&) {
      choice = last_choice;
      throw;
    }
    set_mesh();
  }

  // The device finds the edges if it is used next and can.
  void find_mesh(const Topology& topology) {
    const bool starts =
        options.backend == Backend::cuda || BackendChoice::may_use_gpu(topology.faces.size());
    if (!gpu && starts && may_start_gpu()) start_gpu();
    TopologyFinder* const finder =
        gpu && next() == Backend::cuda ? gpu->topology_finder() : nullptr;
    bool found = false;
    Mesh next_mesh;
    if (finder != nullptr) {
      try {
        next_mesh = Mesh(topology, threads.pool(), finder, nullptr, std::exchange(mesh_memory, {}));
        found = true;
      } catch (const Error& error) {
        gpu_has_mesh = false;  // it has lost the old one
        if (error.code() != ErrorCode::device) throw;
      }
    }
    if (!found)
      next_mesh = Mesh(topology, threads.pool(), nullptr, &mesh, std::exchange(mesh_memory, {}));
    mesh_memory = std::exchange(mesh, std::move(next_mesh)).release_memory();
    gpu_has_mesh = false;
    if (found) keep_found_mesh();
    if (next() == Backend::cuda) start_gpu();
  }

  void keep_found_mesh() {
    try {
      gpu->set_found_mesh(mesh);
      gpu_has_mesh = true;
    } catch (const Error& error) {
      gpu_failed(error);
    }
  }

  // The result of a detection; none while its memory may change.
  void set_contacts(Span<const Contact> contacts) {
    LAZYCCD_ASSERT(are_sorted(contacts, mesh), "a detection returns contacts sorted, none twice");
    LAZYCCD_ASSERT(are_of(contacts, mesh), "contacts name bodies and primitives of the mesh");
    LAZYCCD_ASSERT(are_in_step(contacts), "times of contacts are within the step");
    last_contacts = contacts;
    worlds.set_contacts(contacts);
  }

  // Returns stats with the size of the scene only.
  Stats scene() const {
    Stats empty;
    empty.vertices = static_cast<std::int64_t>(mesh.vertex_count());
    empty.edges = static_cast<std::int64_t>(mesh.edge_count());
    empty.faces = static_cast<std::int64_t>(mesh.faces().size());
    empty.bodies = static_cast<std::int64_t>(mesh.body_count());
    return empty;
  }

  // Runs body(gpu), if the GPU is the next backend, takes the detection and does not fail. Returns
  // whether it did.
  template <class Body>
  bool on_gpu(Body&& body) {
    refusal.clear();
    if (next() != Backend::cuda) return false;
    start_gpu();
    if (!gpu) return false;
    try {
      body(*gpu);
      return true;
    } catch (const NeedsCpu& error) {
      refusal = error.what();
      return false;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::device) throw;  // invalid input is invalid on any backend
      gpu_failed(error);
      return false;
    }
  }

  // Runs a detection and records its time, if there is a choice of backends.
  template <class Detection>
  auto timed(Detection&& detection) {
    Stopwatch watch;
    const int failures_before = failures;
    auto result = detection();
    const bool was_as_chosen = failures == failures_before && refusal.empty();
    if (gpu && options.backend == Backend::automatic && was_as_chosen) choice.record(watch.lap());
    return result;
  }

  Span<const Contact> detect(const Positions& start, const Positions& end, Stats& step) {
    const Stats scene = step;
    Span<const Contact> contacts;
    gpu_has_near_pairs = false;  // also if it throws
    is_from_cpu = !on_gpu([&](DeviceBackend& device) {
      contacts = device.detect(start, end, step);
      if (options.separation > 0) cpu.take_near_distances(device.near_distances());
    });
    gpu_has_near_pairs = !is_from_cpu && options.separation > 0;
    if (!is_from_cpu) return contacts;
    step = scene;
    return detect_on_cpu(start, end, step);
  }

  Span<const Contact> detect_on_cpu(const Positions& start, const Positions& end, Stats& step) {
    is_from_cpu = true;
    mesh.complete(threads.pool());
    return cpu.detect(start, end, step);
  }

  ContactColumns detect_columns(const Positions& start, const Positions& end, std::uint32_t fields,
                                Stats& step) {
    const Stats scene = step;
    ContactColumns found;
    const bool is_found = options.separation == 0 && on_gpu([&](DeviceBackend& device) {
                            found = device.detect_columns(start, end, fields, step);
                          });
    if (is_found) return found;
    step = scene;
    const bool asks_gpu = options.separation > 0 || refusal.empty();
    const Span<const Contact> contacts =
        asks_gpu ? detect(start, end, step) : detect_on_cpu(start, end, step);
    return columns.split(contacts, fields, threads.pool());
  }

  // Runs body(gpu) for a caller whose data lie on the device, so that no other backend can help.
  template <class Body>
  auto on_device(Body&& body) {
    refusal.clear();
    if (may_start_gpu()) start_gpu();
    if (!gpu)
      throw Error(
          ErrorCode::unavailable,
          reason.empty() ? "detection in device memory needs Backend::cuda or automatic" : reason);
    try {
      return body(*gpu);
    } catch (const NeedsCpu&) {
      throw;
    } catch (const Error& error) {
      if (error.code() == ErrorCode::device) gpu_failed(error);
      throw;
    }
  }

  DetectorOptions options;
  Threads threads;
  Mesh mesh;
  MeshMemory mesh_memory;  // of the mesh before
  CpuDetector cpu;
  WorldContacts worlds;
  ColumnCopy columns;                  // of contacts on the host
  std::unique_ptr<DeviceBackend> gpu;  // null: the CPU does the work
  bool gpu_has_mesh = false;           // the GPU has `mesh`
  BackendChoice choice;                // for Backend::automatic
  bool is_from_cpu = false;            // the last detect() was the CPU's
  bool gpu_has_near_pairs = false;     // those of the last detect(), and the CPU lacks them
  int failures = 0;
  std::string reason;   // message of the last failure
  std::string refusal;  // why the GPU did not take the last detection; empty if it was not asked
  Stats stats;
  Span<const Contact> last_contacts;  // of the last detect(), in memory of `cpu` or `gpu`
};

Detector::Detector(const DetectorOptions& options) : Detector(options, Threads(options.threads)) {}

Detector::Detector(const DetectorOptions& options, const Threads& threads) {
  const IeeeArithmetic ieee;
  if (!has_ieee_arithmetic())
    throw Error(ErrorCode::unavailable,
                "LazyCCD was compiled without exact rounding; compile it with IEEE arithmetic and "
                "-ffp-contract=off");
  if (options.threads < 0)
    throw Error(ErrorCode::invalid_argument,
                "threads is negative; 0 means as many as there are cores");
  const Tuning& tuning = options.algorithm.tuning;
  if (tuning.chunk < 0 || tuning.stack < 0 || tuning.idle_threshold < 0)
    throw Error(ErrorCode::invalid_argument,
                "chunk, stack or idle_threshold is negative; 0 means the default");
  if (!(options.separation >= 0 && std::isfinite(options.separation)))
    throw Error(ErrorCode::invalid_argument, "separation is negative or not finite");
  if (options.algorithm.front_period < 1)
    throw Error(ErrorCode::invalid_argument, "front_period must be at least 1 step");
  if (!(options.algorithm.front_ratio > 0))
    throw Error(ErrorCode::invalid_argument, "front_ratio must be positive");
  if (!(options.algorithm.rebuild_ratio > 0))
    throw Error(ErrorCode::invalid_argument, "rebuild_ratio must be positive");
  impl_ = std::make_unique<Impl>(options, threads);
  impl_->set_mesh();
}

Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

void Detector::set_topology(const Topology& topology) {
  const IeeeArithmetic ieee;
  impl_->set_contacts({});
  impl_->cpu.discard_ahead();  // a worker may be reading the old mesh, and the threads are needed
  impl_->set_topology(topology);
}

void Detector::leave_out(Span<const char> edges, Span<const char> vertices) {
  if (!(impl_->options.separation > 0))
    throw Error(ErrorCode::invalid_argument, "leave_out() needs a separation");
  impl_->set_contacts({});
  impl_->cpu.discard_ahead();
  impl_->mesh.complete(impl_->threads.pool());
  impl_->mesh.leave_out(edges, vertices);
  impl_->gpu_has_mesh = impl_->gpu_has_near_pairs = false;
  impl_->set_mesh();
}

bool Detector::set_resting(Span<const char> bodies) {
  if (!(impl_->options.separation > 0))
    throw Error(ErrorCode::invalid_argument, "set_resting() needs a separation");
  if (!(bodies.empty() || bodies.size() == impl_->mesh.body_count()))
    throw Error(ErrorCode::size_mismatch, "set_resting() needs an entry for each body, or none");
  if (std::none_of(bodies.begin(), bodies.end(), [](char rests) { return rests != 0; }))
    bodies = {};
  if (impl_->mesh.has_resting(bodies)) return false;
  impl_->set_contacts({});
  impl_->cpu.discard_ahead();
  impl_->gpu_has_near_pairs = false;
  impl_->mesh.set_resting(bodies);
  impl_->cpu.update_resting();
  return true;
}

Span<const Contact> Detector::detect(const Positions& start, const Positions& end) {
  const IeeeArithmetic ieee;
  Stats stats = impl_->scene();
  impl_->set_contacts({});
  impl_->set_contacts(impl_->timed([&] { return impl_->detect(start, end, stats); }));
  impl_->stats = std::move(stats);
  return impl_->last_contacts;
}

ContactColumns Detector::detect_columns(const Positions& start, const Positions& end,
                                        std::uint32_t fields) {
  const IeeeArithmetic ieee;
  Stats stats = impl_->scene();
  impl_->set_contacts({});
  const ContactColumns columns =
      impl_->timed([&] { return impl_->detect_columns(start, end, fields, stats); });
  impl_->stats = std::move(stats);
  return columns;
}

DeviceContacts Detector::detect_async(const DevicePositions& start, const DevicePositions& end,
                                      CudaStream stream, const std::uint8_t* world_mask) {
  const IeeeArithmetic ieee;
  impl_->set_contacts({});
  return impl_->on_device(
      [&](DeviceBackend& gpu) { return gpu.detect_async(start, end, stream, world_mask); });
}

DeviceContacts Detector::synchronize() {
  const IeeeArithmetic ieee;
  impl_->set_contacts({});
  Stats stats = impl_->scene();
  const DeviceContacts contacts =
      impl_->on_device([&](DeviceBackend& gpu) { return gpu.synchronize(stats); });
  impl_->stats = std::move(stats);
  return contacts;
}

Span<const Contact> Detector::download_contacts() {
  synchronize();
  const IeeeArithmetic ieee;
  impl_->set_contacts(impl_->on_device([](DeviceBackend& gpu) { return gpu.download(); }));
  return impl_->last_contacts;
}

std::vector<Contact> Detector::take_contacts(std::vector<Contact> reuse) {
  const Span<const Contact> contacts = impl_->last_contacts;
  impl_->set_contacts({});
  if (contacts.empty()) {
    reuse.clear();
    return reuse;
  }
  return impl_->cpu.take_contacts(contacts, std::move(reuse));
}

void Detector::detect_ahead(const Positions& start, const Positions& end, double tolerance) {
  const IeeeArithmetic ieee;
  impl_->set_contacts({});
  if (impl_->next() == Backend::cuda) return;
  impl_->gpu_has_near_pairs = false;
  impl_->mesh.complete(impl_->threads.pool());
  impl_->cpu.detect_ahead(start, end, tolerance, impl_->scene());
}

Span<const Contact> Detector::recheck_near_pairs(const Positions& start, const Positions& end) {
  const IeeeArithmetic ieee;
  Stats stats = impl_->scene();
  impl_->set_contacts({});
  impl_->mesh.complete(impl_->threads.pool());
  if (std::exchange(impl_->gpu_has_near_pairs, false))
    impl_->cpu.take_near_pairs(
        impl_->on_device([](DeviceBackend& gpu) { return gpu.near_pairs(); }));
  const Span<const Contact> contacts = impl_->cpu.recheck_near_pairs(start, end, stats);
  impl_->stats = std::move(stats);
  LAZYCCD_ASSERT(are_sorted(contacts, impl_->mesh), "re-checked contacts are sorted, none twice");
  impl_->worlds.set_contacts(contacts);
  return contacts;
}

Span<const double> Detector::near_distances() const { return impl_->cpu.near_distances(); }
bool Detector::can_recheck_any_motion() const {
  return impl_->is_from_cpu && impl_->cpu.can_recheck_any_motion();
}

std::int32_t Detector::world_count() const { return impl_->mesh.world_count(); }
Span<const std::size_t> Detector::world_offsets() {
  return impl_->worlds.offsets(impl_->threads.pool());
}
Span<const Contact> Detector::contacts_of_world(std::int32_t world) {
  return impl_->worlds.of(world);
}
std::uint64_t Detector::hash_of_world(std::int32_t world) { return impl_->worlds.hash(world); }

Span<const Edge> Detector::edges() const {
  impl_->mesh.complete(impl_->threads.pool());
  return impl_->mesh.edges();
}
const Stats& Detector::stats() const { return impl_->stats; }
std::string Detector::status() const {
  if (!impl_->refusal.empty()) return "cpu, because " + impl_->refusal;
  const std::string backend = impl_->gpu && impl_->next() == Backend::cuda ? "cuda" : "cpu";
  return impl_->reason.empty() ? backend
                               : backend + ", because the device failed: " + impl_->reason;
}

std::uint64_t contact_hash(Span<const Contact> contacts) {
  std::uint64_t hash = 0;
  for (const Contact& c : contacts) hash += hash_share(c);
  return hash;
}

}  // namespace lazyccd
