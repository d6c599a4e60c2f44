#include "records.h"

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <cstdint>
#include <cstring>

namespace lazyccd::pybullet {

using bullet::StepContact;

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

std::string excluded_records(const std::vector<bullet::ExcludedBody>& bodies) {
  std::string bytes;
  for (const bullet::ExcludedBody& excluded : bodies) {
    const std::int32_t record[] = {excluded.body->getUserIndex2(), excluded.node,
                                   static_cast<std::int32_t>(excluded.reason)};
    bytes.append(reinterpret_cast<const char*>(record), sizeof record);
  }
  return bytes;
}

}  // namespace lazyccd::pybullet
