#include "research/culling/excluded_orphans.h"

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "core/narrow/contact_math.h"
#include "core/narrow/decision.h"
#include "cpu/narrow/narrow_phase.h"

namespace lazyccd::research {
namespace {

// Returns whether the filters let the bodies of the pair collide, and no axis separates its
// primitives during the whole step.
template <ContactKind kind>
bool may_touch(const Mesh& mesh, const std::vector<VertexRecord>& records, Candidate pair) {
  Contact contact;
  identify_contact<kind>(mesh.view(), pair, contact);
  if (!mesh.collide(contact.body_a, contact.body_b)) return false;
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    const double* x = records[contact.vertices[i]].x;
    q.start[i] = {x[0], x[1], x[2]};
    q.end[i] = {x[3], x[4], x[5]};
  }
  return !separated_along_axes<kind>(q);
}

bool may_touch(ContactKind kind, const Mesh& mesh, const std::vector<VertexRecord>& records,
               Candidate pair) {
  return kind == ContactKind::vertex_face ? may_touch<ContactKind::vertex_face>(mesh, records, pair)
                                          : may_touch<ContactKind::edge_edge>(mesh, records, pair);
}

}  // namespace

void ExcludedOrphans::set_mesh(const Mesh& mesh) {
  mesh_ = &mesh;
  orphans_ = OrphanSets(mesh);
}

int ExcludedOrphans::remove_from(ContactKind kind, Candidate* items, int count) const {
  const OrphanList orphans = orphans_.of(kind);
  const auto is_orphan = [&](Candidate c) { return orphans.contains(kind, c); };
  return static_cast<int>(std::remove_if(items, items + count, is_orphan) - items);
}

void ExcludedOrphans::push_to(Span<NarrowPhase* const> workers,
                              const std::vector<VertexRecord>& vertices, ThreadPool& pool,
                              Stats& stats) const {
  std::atomic<std::int64_t> near{0};
  const LeafScene& scene = workers[0]->scene();
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
    if (!(kind == ContactKind::vertex_face ? scene.vertex_face : scene.edge_edge)) continue;
    const OrphanList orphans = orphans_.of(kind);
    pool.parallel_for(orphans.count, 1024, [&](std::size_t first, std::size_t last, int id) {
      std::int64_t pushed = 0;
      for (std::size_t i = first; i < last; ++i) {
        if (!may_touch(kind, *mesh_, vertices, orphans.pairs[i])) continue;
        workers[static_cast<std::size_t>(id)]->push(kind, orphans.pairs[i]);
        ++pushed;
      }
      near.fetch_add(pushed, std::memory_order_relaxed);  // read after the end of the job
    });
  }
  stats.orphan_tests = near.load(std::memory_order_relaxed);
}

}  // namespace lazyccd::research
