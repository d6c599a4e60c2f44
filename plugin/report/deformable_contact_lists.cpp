#include <BulletSoftBody/btSoftBodyInternals.h>

#include <algorithm>
#include <array>
#include <utility>

#include "report/bullet_contact_lists.h"
#include "report/contact_fields.h"
#include "report/faces_of_nodes.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Returns whether Bullet would test the faces of a body, and not only its nodes, against rigid
// bodies or multibodies.
bool has_face_contacts(const btSoftBody& body) {
  return (body.m_cfg.collisions &
          (btSoftBody::fCollision::SDF_RDF | btSoftBody::fCollision::SDF_MDF)) != 0;
}

// The contact with its soft body as body_a; the other one is rigid.
StepContact seen_from_soft(StepContact contact) {
  if (btSoftBody::upcast(contact.body_a)) return contact;
  std::swap(contact.body_a, contact.body_b);
  contact.normal = -contact.normal;
  contact.friction_impulse = -contact.friction_impulse;
  for (double& weight : contact.weights) weight = -weight;
  return contact;
}

// Distance of the surfaces beyond their margins, along the normal, as Bullet's deformable contacts
// have it. `point`: on the soft body.
btScalar distance_of(const StepContact& contact, const btVector3& point) {
  return (point - contact.point).dot(contact.normal) -
         contact.body_a->getCollisionShape()->getMargin() -
         contact.body_b->getCollisionShape()->getMargin();
}

// Appends a contact of a face with a rigid body, if the primitive of the soft body is a part of a
// face.
void add_face_contact(const StepContact& contact, const FacesOfNodes& faces) {
  std::array<const btSoftBody::Node*, 3> nodes{};  // of the primitive of the soft body
  std::array<btScalar, 3> shares{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (contact.nodes[i] == nullptr || count == nodes.size()) continue;
    nodes[count] = contact.nodes[i];
    shares[count++] = static_cast<btScalar>(contact.weights[i]);
  }
  btSoftBody::Face* const face =
      contact.face != nullptr ? contact.face : faces.find(nodes[0], nodes[1]);
  if (face == nullptr) return;
  btSoftBody& body = *btSoftBody::upcast(contact.body_a);
  auto& rigid = append_rigid_contact(contact, body, body.m_faceRigidContacts);
  rigid.m_face = face;
  rigid.m_bary.setZero();
  for (int corner = 0; corner < 3; ++corner)
    for (std::size_t i = 0; i < count; ++i)
      if (face->m_n[corner] == nodes[i]) rigid.m_bary[corner] = shares[i];
  rigid.m_contactPoint =
      BaryEval(face->m_n[0]->m_x, face->m_n[1]->m_x, face->m_n[2]->m_x, rigid.m_bary);
  rigid.m_weights = rigid.m_bary * (2 / (1 + rigid.m_bary.length2()));
  // If the face is soft, the point is on it, and that on the rigid body is not known.
  rigid.m_cti.m_offset = contact.face != nullptr ? 0 : distance_of(contact, rigid.m_contactPoint);
  rigid.m_c5.setIdentity();
}

// Appends the contacts of faces with rigid bodies.
void fill_face_contacts(Span<const StepContact> contacts) {
  // Of the bodies that have such contacts, which are sorted by bodies.
  ScratchVector<std::pair<btSoftBody*, FacesOfNodes>> faces;
  for (const StepContact& given : contacts) {
    if (btSoftBody::upcast(given.body_a) && btSoftBody::upcast(given.body_b)) continue;
    const StepContact contact = seen_from_soft(given);
    btSoftBody* const body = btSoftBody::upcast(contact.body_a);
    if (!has_face_contacts(*body)) continue;
    auto found = std::find_if(faces.rbegin(), faces.rend(),
                              [body](const auto& of) { return of.first == body; });
    if (found == faces.rend()) {
      faces.emplace_back(body, *body);
      found = faces.rbegin();
    }
    add_face_contact(contact, found->second);
  }
}

}  // namespace

void clear_deformable_contact_lists(btSoftBody& body) {
  body.m_nodeRigidContacts.clear();
  body.m_faceRigidContacts.clear();
  body.m_faceNodeContacts.resize(0);
  body.m_faceNodeContactsCCD.resize(0);
}

void fill_deformable_contact_lists(Span<const StepContact> contacts) {
  for (btSoftBody* const body : sleepers_with(contacts)) clear_deformable_contact_lists(*body);
  fill_face_contacts(contacts);
  // Fills the lists as Bullet's CollideVF_DD does (btSoftBodyInternals.h). applyRepulsionForce has
  // already run in this step, and the lists are cleared before it runs again. So only applications
  // read them.
  for (const StepContact& contact : contacts) {
    btSoftBody* const node_body = btSoftBody::upcast(contact.body_a);
    if (!node_body || contact.kind != ContactKind::vertex_face) continue;
    if (!contact.face) {
      auto& rigid = append_rigid_contact(contact, *node_body, node_body->m_nodeRigidContacts);
      rigid.m_node = contact.nodes[0];
      rigid.m_cti.m_offset = distance_of(contact, rigid.m_node->m_x);
      rigid.m_c5.setIdentity();
      continue;
    }
    const btSoftBody& a = *node_body;
    const btSoftBody& b = *btSoftBody::upcast(contact.body_b);
    btSoftBody::DeformableFaceNodeContact c;
    c.m_node = contact.nodes[0];
    c.m_face = contact.face;
    c.m_bary = face_weights(contact);
    c.m_weights = btVector3(0, 0, 0);
    c.m_normal = contact.normal;
    c.m_margin = a.getCollisionShape()->getMargin() + b.getCollisionShape()->getMargin();
    c.m_friction = a.m_cfg.kDF * b.m_cfg.kDF;
    c.m_imf = 0;
    c.m_c0 = 0;
    c.m_colObj = contact.body_b;
    node_body->m_faceNodeContacts.push_back(c);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
