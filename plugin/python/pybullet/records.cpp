#include "records.h"

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <cstdint>
#include <cstring>
#include <type_traits>

#include "number_text.h"

namespace lazyccd::pybullet {

using bullet::StepContact;
using bullet::StepStats;

namespace {

struct ContactRecord {
  std::int32_t kind, body_a, link_a, body_b, link_b;
  std::int32_t nodes[4];
  std::int32_t unused;
  double weights[4];
  double point[3], normal[3];
  double toi, impulse;
  double friction_impulse[3];
};
static_assert(sizeof(ContactRecord) == 40 + 15 * 8, "lazyccd/pybullet.py has another layout");

void name_body(const btCollisionObject& object, std::int32_t& body, std::int32_t& link) {
  const btMultiBodyLinkCollider* const collider = btMultiBodyLinkCollider::upcast(&object);
  body = collider ? collider->m_multiBody->getUserIndex2() : object.getUserIndex2();
  link = collider ? collider->m_link : -1;
}

void copy(const btVector3& from, double (&to)[3]) {
  for (int k = 0; k < 3; ++k) to[k] = from[k];
}

ContactRecord record_of(const StepContact& contact) {
  ContactRecord record = {};
  record.kind = static_cast<std::int32_t>(contact.kind);
  name_body(*contact.body_a, record.body_a, record.link_a);
  name_body(*contact.body_b, record.body_b, record.link_b);
  const int first_of_b = first_vertex_of_b(contact.kind);
  for (int i = 0; i < 4; ++i) {
    const btSoftBody* const body =
        btSoftBody::upcast(i < first_of_b ? contact.body_a : contact.body_b);
    const btSoftBody::Node* const node = contact.nodes[i];
    record.nodes[i] = body && node ? static_cast<std::int32_t>(node - &body->m_nodes[0]) : -1;
    record.weights[i] = contact.weights[i];
  }
  copy(contact.point, record.point);
  copy(contact.normal, record.normal);
  record.toi = contact.toi;
  record.impulse = contact.impulse;
  copy(contact.friction_impulse, record.friction_impulse);
  return record;
}

}  // namespace

std::string contact_records(Span<const StepContact> contacts) {
  std::string bytes(contacts.size() * sizeof(ContactRecord), '\0');
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactRecord record = record_of(contacts[i]);
    std::memcpy(&bytes[i * sizeof record], &record, sizeof record);
  }
  return bytes;
}

std::string stats_text(const StepStats& s) {
  std::string lines;
  const auto add = [&lines](const char* name, auto value) {
    lines += std::string(name) + " ";
    if constexpr (std::is_floating_point_v<decltype(value)>)
      lines += number_text(value);
    else
      lines += std::to_string(value);
    lines += "\n";
  };
  add("steps", s.steps);
  add("soft_bodies", s.soft_bodies);
  add("sleeping_bodies", s.sleeping_bodies);
  add("handled_pairs", s.handled_pairs);
  add("detections", s.detections);
  add("started_ahead", s.started_ahead);
  add("contacts_vf", s.contacts_vf);
  add("contacts_ee", s.contacts_ee);
  add("impact_zone_nodes", s.impact_zone_nodes);
  add("failsafe_holds", s.failsafe_holds);
  add("unresolved", s.unresolved);
  add("initial_contacts", s.initial_contacts);
  add("initial_intersections", s.initial_intersections);
  add("fallback_steps", s.fallback_steps);
  add("energy_gained", s.energy_gained);
  add("energy_lost", s.energy_lost);
  add("ms_gather", s.ms_gather);
  add("ms_detect", s.ms_detect);
  add("ms_response", s.ms_response);
  add("ms_write", s.ms_write);
  return lines;
}

}  // namespace lazyccd::pybullet
