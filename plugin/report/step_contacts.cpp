#include "report/step_contacts.h"

#include <algorithm>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

StepContact step_contact(const Contact& contact, const Vector3d& impulse, const SoftScene& scene,
                         const StepTopology& topology, const Motion& motion) {
  StepContact c;
  c.kind = contact.kind;
  c.body_a = topology.bodies()[contact.body_a].object;
  c.body_b = topology.bodies()[contact.body_b].object;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    c.nodes[i] = topology.is_soft(v) ? &scene.node(v) : nullptr;
  }
  const bool has_face =
      c.kind == ContactKind::vertex_face && topology.bodies()[contact.body_b].soft;
  c.face = has_face ? &scene.face(contact.primitive_b) : nullptr;
  c.weights = contact.weights();
  c.normal = btVector3(contact.normal[0], contact.normal[1], contact.normal[2]);
  Vector3d on_b = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    if (c.weights[i] < 0) on_b -= c.weights[i] * motion.end_of(contact.vertices[i]);
  }
  c.point = to_bullet(on_b);
  c.toi = contact.toi;
  const Vector3d normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  c.impulse = std::max(0.0, impulse.dot(normal));
  c.friction_impulse = to_bullet(impulse - impulse.dot(normal) * normal);
  return c;
}

// The rows of a pair: rows[first] up to rows[last].
struct PairRows {
  std::size_t first, last;
};

ScratchVector<PairRows> rows_by_pair(const std::vector<const ContactRow*>& rows) {
  ScratchVector<PairRows> pairs;
  pairs.reserve(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i == 0 || rows[i - 1]->contact < rows[i]->contact) pairs.push_back({i, i});
    pairs.back().last = i + 1;
  }
  return pairs;
}

}  // namespace

void make_step_contacts(const std::vector<const ContactRow*>& rows,
                        const std::vector<Contact>& report_only_contacts, const SoftScene& scene,
                        const StepTopology& topology, const Motion& motion, const Threads& threads,
                        std::vector<StepContact>& contacts) {
  LAZYCCD_ASSERT(are_in_order(rows), "rows to report are in the order of their contacts");
  LAZYCCD_ASSERT(are_of(report_only_contacts, motion), "contacts to report are of the motion");
  const ScratchVector<PairRows> pairs = rows_by_pair(rows);
  contacts.resize(pairs.size() + report_only_contacts.size());
  const auto make = [&](std::size_t i) {
    if (i >= pairs.size())
      return step_contact(report_only_contacts[i - pairs.size()], Vector3d::Zero(), scene, topology,
                          motion);
    // A pair may have several rows: report the one with the earliest time of impact.
    const ContactRow* earliest = rows[pairs[i].first];
    Vector3d impulse = Vector3d::Zero();
    for (std::size_t row = pairs[i].first; row < pairs[i].last; ++row) {
      if (rows[row]->contact.toi < earliest->contact.toi) earliest = rows[row];
      impulse += rows[row]->impulse();
    }
    return step_contact(earliest->contact, impulse / motion.dt(), scene, topology, motion);
  };
  threads.parallel_for(contacts.size(), 256, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) contacts[i] = make(i);
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
