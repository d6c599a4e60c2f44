#include "lazyccd/detector.h"

#include <utility>

#include "core/contact_math.h"
#include "cpu/cpu_detector.h"
#include "lazyccd/error.h"

namespace lazyccd {

struct Detector::Impl {
  explicit Impl(const Options& o) : options(o), cpu(o) {}

  Options options;
  Mesh mesh;
  CpuDetector cpu;
  std::vector<Contact> contacts;
  Stats stats;
};

Detector::Detector(const Options& options) {
  if (options.threads < 0)
    throw Error(ErrorCode::invalid_argument, "threads is negative; 0 means as many as the machine has");
  if (options.front_period < 1)
    throw Error(ErrorCode::invalid_argument, "front_period must be at least 1 step");
  if (!(options.front_ratio > 0))
    throw Error(ErrorCode::invalid_argument, "front_ratio must be positive");
  if (!(options.rebuild_ratio > 0))
    throw Error(ErrorCode::invalid_argument, "rebuild_ratio must be positive");
  if (options.backend == Backend::cuda)
    throw Error(ErrorCode::unavailable, "this build has no CUDA backend");
  impl_ = std::make_unique<Impl>(options);
  impl_->cpu.set_mesh(impl_->mesh);
}

Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

void Detector::set_topology(const Topology& topology) {
  Mesh mesh(topology);
  impl_->mesh = std::move(mesh);
  impl_->cpu.set_mesh(impl_->mesh);
}

Span<const Contact> Detector::detect(const Positions& start, const Positions& end) {
  Stats stats;
  stats.vertices = static_cast<std::int64_t>(impl_->mesh.vertex_count());
  stats.edges = static_cast<std::int64_t>(impl_->mesh.edges().size());
  stats.faces = static_cast<std::int64_t>(impl_->mesh.faces().size());
  stats.bodies = static_cast<std::int64_t>(impl_->mesh.body_count());
  impl_->cpu.detect(start, end, impl_->contacts, stats);
  for (const Contact& c : impl_->contacts)
    ++(c.kind == ContactKind::vertex_face ? stats.contacts_vf : stats.contacts_ee);
  impl_->stats = std::move(stats);
  return {impl_->contacts.data(), impl_->contacts.size()};
}

Span<const Edge> Detector::edges() const { return impl_->mesh.edges(); }
const Stats& Detector::stats() const { return impl_->stats; }
std::string Detector::status() const { return "cpu"; }

std::uint64_t contact_hash(Span<const Contact> contacts) {
  std::uint64_t hash = 0;
  for (const Contact& c : contacts) hash += hash_share(c);
  return hash;
}

}  // namespace lazyccd
