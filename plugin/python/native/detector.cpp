#include <lazyccd/detector.h>
#include <lazyccd/error.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"

namespace lazyccd::python {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

// The record types of lazyccd/records.py have these layouts.
static_assert(sizeof(Contact) == 64, "lazyccd/records.py has another layout");
static_assert(sizeof(Body) == 24, "lazyccd/records.py has another layout");

template <class T, class... Shape>
using Array = nb::ndarray<const T, nb::device::cpu, nb::c_contig, Shape...>;
using Vertices = nb::ndarray<nb::ro, nb::device::cpu, nb::shape<-1, 3>>;

template <class T, class Source>
Span<const T> span(const Source& array) {
  return {reinterpret_cast<const T*>(array.data()), array.shape(0)};
}

Positions positions(const Vertices& array) {
  const std::size_t count = array.shape(0);
  if (array.dtype() == nb::dtype<float>())
    return {static_cast<const float*>(array.data()), count,
            static_cast<std::size_t>(array.stride(0)) * sizeof(float)};
  return {static_cast<const double*>(array.data()), count,
          static_cast<std::size_t>(array.stride(0)) * sizeof(double)};
}

// Memory that arrays of contacts no longer use. Outlives the detector if an array does.
class SpareMemory {
 public:
  std::vector<Contact> take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::move(spare_);
  }
  void give(std::vector<Contact> memory) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (memory.capacity() > spare_.capacity()) spare_ = std::move(memory);
  }

 private:
  std::mutex mutex_;
  std::vector<Contact> spare_;
};

// Contacts that an array shows. The array owns them.
struct OwnedContacts {
  std::vector<Contact> contacts;
  std::shared_ptr<SpareMemory> spare;
};

// A view of device memory: the numbers of the CUDA array interface.
DevicePositions device_positions(std::uintptr_t address, std::size_t count, std::size_t stride,
                                 bool is_double) {
  if (is_double) return {reinterpret_cast<const double*>(address), count, stride};
  return {reinterpret_cast<const float*>(address), count, stride};
}

// Addresses of contacts and status, room for contacts, index of the device.
nb::tuple addresses(const DeviceContacts& found) {
  return nb::make_tuple(reinterpret_cast<std::uintptr_t>(found.contacts),
                        reinterpret_cast<std::uintptr_t>(found.status), found.capacity,
                        found.device);
}

// Device memory as a DLPack capsule. kind: 'i', 'u' or 'f'; strides are
// counted in elements.
nb::ndarray<> device_array(std::uintptr_t address, const std::vector<std::size_t>& shape,
                           const std::vector<std::int64_t>& strides, const std::string& kind,
                           int bits, int device, nb::handle owner) {
  const auto code = kind == "f"   ? nb::dlpack::dtype_code::Float
                    : kind == "u" ? nb::dlpack::dtype_code::UInt
                                  : nb::dlpack::dtype_code::Int;
  const nb::dlpack::dtype type{static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(bits), 1};
  return {reinterpret_cast<void*>(address), shape.size(), shape.data(), owner, strides.data(), type,
          nb::device::cuda::value,          device};
}

using Bytes = nb::ndarray<nb::numpy, std::uint8_t, nb::ndim<1>, nb::c_contig>;

Bytes bytes_of(std::unique_ptr<OwnedContacts> owned) {
  OwnedContacts* const raw = owned.release();
  const nb::capsule owner(raw, [](void* p) noexcept {
    const std::unique_ptr<OwnedContacts> ended(static_cast<OwnedContacts*>(p));
    ended->spare->give(std::move(ended->contacts));
  });
  return Bytes(raw->contacts.data(), {raw->contacts.size() * sizeof(Contact)}, owner);
}

Backend parse_backend(const std::string& name) {
  if (name == "auto") return Backend::automatic;
  if (name == "cpu") return Backend::cpu;
  if (name == "cuda") return Backend::cuda;
  throw Error(ErrorCode::invalid_argument,
              "unknown backend '" + name + "'; there are auto, cpu, cuda");
}

// A detector that several Python threads may use, one at a time.
class PyDetector {
 public:
  explicit PyDetector(const DetectorOptions& options) : detector_(options) {}

  void set_topology(std::size_t vertex_count, const Array<std::int32_t, nb::shape<-1, 3>>& faces,
                    const Array<std::int32_t, nb::shape<-1, 2>>& edges,
                    const Array<std::int32_t, nb::ndim<1>>& body_of_vertex,
                    const Array<float, nb::ndim<1>>& inverse_mass,
                    const Array<float, nb::ndim<1>>& self_separation,
                    const Array<std::uint8_t, nb::shape<-1, 24>>& bodies,
                    const Array<std::int32_t, nb::shape<-1, 2>>& disabled_pairs) {
    Topology topology;
    topology.vertex_count = vertex_count;
    topology.faces = span<Face>(faces);
    topology.edges = span<Edge>(edges);
    topology.body_of_vertex = span<std::int32_t>(body_of_vertex);
    topology.inverse_mass = span<float>(inverse_mass);
    topology.self_separation = span<float>(self_separation);
    topology.bodies = span<Body>(bodies);
    topology.disabled_pairs = span<BodyPair>(disabled_pairs);
    const nb::gil_scoped_release released;
    const std::lock_guard<std::mutex> lock(mutex_);
    detector_.set_topology(topology);
  }

  Bytes detect(const Vertices& start, const Vertices& end) {
    auto owned = std::make_unique<OwnedContacts>();
    owned->spare = spare_;
    {
      const nb::gil_scoped_release released;
      const std::lock_guard<std::mutex> lock(mutex_);
      detector_.detect(positions(start), positions(end));
      owned->contacts = detector_.take_contacts(spare_->take());
    }
    return bytes_of(std::move(owned));
  }

  nb::tuple detect_async(std::uintptr_t start, std::size_t start_stride, std::uintptr_t end,
                         std::size_t end_stride, std::size_t count, bool is_double,
                         std::uintptr_t stream, std::uintptr_t world_mask) {
    DeviceContacts found;
    {
      const nb::gil_scoped_release released;
      const std::lock_guard<std::mutex> lock(mutex_);
      found = detector_.detect_async(device_positions(start, count, start_stride, is_double),
                                     device_positions(end, count, end_stride, is_double),
                                     reinterpret_cast<CudaStream>(stream),
                                     reinterpret_cast<const std::uint8_t*>(world_mask));
    }
    return addresses(found);
  }

  nb::tuple synchronize() {
    DeviceContacts found;
    {
      const nb::gil_scoped_release released;
      const std::lock_guard<std::mutex> lock(mutex_);
      found = detector_.synchronize();
    }
    return addresses(found);
  }

  Bytes download_contacts() {
    auto owned = std::make_unique<OwnedContacts>();
    owned->spare = spare_;
    {
      const nb::gil_scoped_release released;
      const std::lock_guard<std::mutex> lock(mutex_);
      detector_.download_contacts();
      owned->contacts = detector_.take_contacts(spare_->take());
    }
    return bytes_of(std::move(owned));
  }

  nb::ndarray<nb::numpy, std::int32_t, nb::shape<-1, 2>> edges() {
    auto copy = std::make_unique<std::vector<Edge>>();
    {
      const nb::gil_scoped_release released;
      const std::lock_guard<std::mutex> lock(mutex_);
      const Span<const Edge> all = detector_.edges();
      copy->assign(all.begin(), all.end());
    }
    auto* const raw = copy.release();
    const nb::capsule owner(raw,
                            [](void* p) noexcept { delete static_cast<std::vector<Edge>*>(p); });
    return {raw->empty() ? nullptr : raw->front().data(), {raw->size(), 2}, owner};
  }

  Stats stats() {
    const nb::gil_scoped_release released;
    const std::lock_guard<std::mutex> lock(mutex_);
    return detector_.stats();
  }
  std::string status() {
    const nb::gil_scoped_release released;
    const std::lock_guard<std::mutex> lock(mutex_);
    return detector_.status();
  }

 private:
  std::mutex mutex_;
  Detector detector_;
  std::shared_ptr<SpareMemory> spare_ = std::make_shared<SpareMemory>();
};

void bind_stats(nb::module_& module) {
  nb::class_<Stats> stats(module, "Stats",
                          "Counters and times (milliseconds) of one detection, as in "
                          "lazyccd/stats.h.");
  stats.def_ro("vertices", &Stats::vertices)
      .def_ro("edges", &Stats::edges)
      .def_ro("faces", &Stats::faces)
      .def_ro("bodies", &Stats::bodies)
      .def_ro("groups", &Stats::groups)
      .def_ro("tree_tests", &Stats::tree_tests)
      .def_ro("group_pairs", &Stats::group_pairs)
      .def_ro("candidates_vf", &Stats::candidates_vf)
      .def_ro("candidates_ee", &Stats::candidates_ee)
      .def_ro("listed_candidates", &Stats::listed_candidates)
      .def_ro("survivors_vf", &Stats::survivors_vf)
      .def_ro("survivors_ee", &Stats::survivors_ee)
      .def_ro("double_precision_tests", &Stats::double_precision_tests)
      .def_ro("exact_tests", &Stats::exact_tests)
      .def_ro("near_pairs", &Stats::near_pairs)
      .def_ro("contacts_vf", &Stats::contacts_vf)
      .def_ro("contacts_ee", &Stats::contacts_ee)
      .def_ro("rebuilt", &Stats::rebuilt)
      .def_ro("ms_upload", &Stats::ms_upload)
      .def_ro("ms_refit", &Stats::ms_refit)
      .def_ro("ms_traverse", &Stats::ms_traverse)
      .def_ro("ms_narrow", &Stats::ms_narrow)
      .def_ro("ms_sort", &Stats::ms_sort)
      .def_ro("ms_download", &Stats::ms_download)
      .def_ro("ms_device", &Stats::ms_device)
      .def_ro("ms_total", &Stats::ms_total)
      .def_ro("hash", &Stats::hash, "contact_hash() of the contacts")
      .def_ro("peak_bytes", &Stats::peak_bytes)
      .def_ro("threads", &Stats::threads)
      .def_ro("backend", &Stats::backend, "'cpu' or 'cuda'")
      .def_ro("device", &Stats::device);
}

}  // namespace

void bind_detector(nb::module_& module) {
  bind_stats(module);
  nb::class_<PyDetector>(module, "Detector")
      .def(
          "__init__",
          [](PyDetector* self, const std::string& backend, int threads, bool vertex_face,
             bool edge_edge, double separation, bool reduce_contacts, const std::string& strategy,
             const std::string& volume, int device) {
            DetectorOptions options;
            options.device = device;
            options.backend = parse_backend(backend);
            options.threads = threads;
            options.vertex_face = vertex_face;
            options.edge_edge = edge_edge;
            options.separation = separation;
            options.reduce_contacts = reduce_contacts;
            options.algorithm.strategy = parse_strategy(strategy);
            options.algorithm.volume = parse_volume(volume);
            new (self) PyDetector(options);
          },
          "backend"_a, "threads"_a, "vertex_face"_a, "edge_edge"_a, "separation"_a,
          "reduce_contacts"_a, "strategy"_a, "volume"_a, "device"_a)
      .def("set_topology", &PyDetector::set_topology, "vertex_count"_a, "faces"_a, "edges"_a,
           "body_of_vertex"_a, "inverse_mass"_a, "self_separation"_a, "bodies"_a,
           "disabled_pairs"_a)
      .def("detect", &PyDetector::detect, "start"_a, "end"_a,
           "Returns the memory of the contacts, one record of 64 bytes each.")
      .def("detect_async", &PyDetector::detect_async, "start"_a, "start_stride"_a, "end"_a,
           "end_stride"_a, "count"_a, "is_double"_a, "stream"_a, "world_mask"_a,
           "Returns the addresses of contacts and status, the room for contacts, and the device.")
      .def("synchronize", &PyDetector::synchronize)
      .def("download_contacts", &PyDetector::download_contacts)
      .def_prop_ro("edges", &PyDetector::edges, nb::rv_policy::move)
      .def_prop_ro("stats", &PyDetector::stats)
      .def_prop_ro("status", &PyDetector::status);
  module.def("device_array", &device_array, "address"_a, "shape"_a, "strides"_a, "kind"_a, "bits"_a,
             "device"_a, "owner"_a, "Device memory as a DLPack capsule.");
  module.def(
      "contact_hash",
      [](const Array<std::uint8_t, nb::shape<-1, 64>>& contacts) {
        return contact_hash(span<Contact>(contacts));
      },
      "contacts"_a);
}

}  // namespace lazyccd::python
