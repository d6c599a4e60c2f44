#include "report/step_contacts.h"

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

StepContact step_contact(const Contact& contact, const Eigen::Vector3d& impulse,
                         const SoftScene& scene, const StepTopology& topology,
                         const Motion& motion) {
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
  Eigen::Vector3d on_b = Eigen::Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    if (c.weights[i] < 0) on_b -= c.weights[i] * motion.end_of(contact.vertices[i]);
  }
  c.point = to_bullet(on_b);
  c.toi = contact.toi;
  const Eigen::Vector3d normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  c.impulse = std::max(0.0, impulse.dot(normal));
  c.friction_impulse = to_bullet(impulse - impulse.dot(normal) * normal);
  return c;
}

}  // namespace

std::vector<StepContact> step_contacts(const std::vector<const ContactRow*>& rows,
                                       const std::vector<Contact>& report_only_contacts,
                                       const SoftScene& scene, const StepTopology& topology,
                                       const Motion& motion) {
  std::vector<StepContact> contacts;
  contacts.reserve(rows.size() + report_only_contacts.size());
  const auto append = [&](const Contact& contact, const Eigen::Vector3d& impulse) {
    contacts.push_back(step_contact(contact, impulse, scene, topology, motion));
  };
  for (std::size_t i = 0; i < rows.size();) {
    // A pair may have several rows: report the one with the earliest time of impact.
    const ContactRow* first = rows[i];
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
    for (const Contact& pair = rows[i]->contact; i < rows.size() && !(pair < rows[i]->contact);
         ++i) {
      if (rows[i]->contact.toi < first->contact.toi) first = rows[i];
      impulse += rows[i]->impulse();
    }
    append(first->contact, impulse / motion.dt);
  }
  for (const Contact& contact : report_only_contacts) append(contact, Eigen::Vector3d::Zero());
  return contacts;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
