#include "report/bullet_contact_lists.h"

#include <BulletSoftBody/btSoftBodyInternals.h>

#include <set>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

// A contact of a node with a rigid body. Both worlds name these members alike.
template <class RigidContact>
RigidContact rigid_contact(const StepContact& contact, const btSoftBody& body) {
  RigidContact rigid;
  rigid.m_cti.m_colObj = contact.body_b;
  rigid.m_cti.m_normal = contact.normal;
  rigid.m_cti.m_offset = -contact.normal.dot(contact.point);
  rigid.m_node = contact.nodes[0];
  rigid.m_c0.setIdentity();
  rigid.m_c1 = contact.point - contact.body_b->getWorldTransform().getOrigin();
  rigid.m_c2 = rigid.m_c4 = 0;
  rigid.m_c3 = body.m_cfg.kDF * contact.body_b->getFriction();
  btPlaneSpace1(contact.normal, rigid.t1, rigid.t2);
  return rigid;
}

// Weights of the face's corners.
btVector3 face_weights(const StepContact& contact) {
  return btVector3(static_cast<btScalar>(-contact.weights[1]),
                   static_cast<btScalar>(-contact.weights[2]),
                   static_cast<btScalar>(-contact.weights[3]));
}

// The sleeping bodies with contacts in this step. Their lists are those of an old step.
std::set<btSoftBody*> sleepers_with(Span<const StepContact> contacts) {
  std::set<btSoftBody*> bodies;
  for (const StepContact& contact : contacts) {
    btSoftBody* const body = btSoftBody::upcast(contact.body_a);
    if (body && !body->isActive()) bodies.insert(body);
  }
  return bodies;
}

}  // namespace

void clear_soft_contact_lists(btSoftBody& body) {
  body.m_scontacts.resize(0);
  body.m_rcontacts.clear();
}

void clear_deformable_contact_lists(btSoftBody& body) {
  body.m_nodeRigidContacts.clear();
  body.m_faceRigidContacts.clear();
  body.m_faceNodeContacts.resize(0);
  body.m_faceNodeContactsCCD.resize(0);
}

void fill_soft_contact_lists(Span<const StepContact> contacts) {
  for (btSoftBody* const body : sleepers_with(contacts)) clear_soft_contact_lists(*body);
  // Fills the list as Bullet's CollideVF_SS does (btSoftBodyInternals.h). Bullet's solver has
  // finished this step and clears the list before the next one. So only applications read it.
  for (const StepContact& contact : contacts) {
    btSoftBody* const node_body = btSoftBody::upcast(contact.body_a);
    if (!node_body || contact.kind != ContactKind::vertex_face) continue;
    if (!contact.face) {
      node_body->m_rcontacts.push_back(rigid_contact<btSoftBody::RContact>(contact, *node_body));
      continue;
    }
    const btSoftBody& a = *node_body;
    const btSoftBody& b = *btSoftBody::upcast(contact.body_b);
    btSoftBody::SContact c;
    c.m_node = contact.nodes[0];
    c.m_face = contact.face;
    c.m_weights = face_weights(contact);
    c.m_normal = contact.normal;
    c.m_margin = a.getCollisionShape()->getMargin() + b.getCollisionShape()->getMargin();
    c.m_friction = btMax(a.m_cfg.kDF, b.m_cfg.kDF);
    const btScalar node_share = contact.nodes[0]->m_im;
    btScalar face_share = 0;
    for (int k = 0; k < 3; ++k) face_share += c.m_weights[k] * contact.nodes[k + 1]->m_im;
    const btScalar shares = node_share + face_share;
    c.m_cfm[0] = shares > 0 ? node_share / shares * a.m_cfg.kSHR : 0;
    c.m_cfm[1] = shares > 0 ? face_share / shares * b.m_cfg.kSHR : 0;
    node_body->m_scontacts.push_back(c);
  }
}

void fill_deformable_contact_lists(Span<const StepContact> contacts) {
  for (btSoftBody* const body : sleepers_with(contacts)) clear_deformable_contact_lists(*body);
  // Fills the lists as Bullet's CollideVF_DD does (btSoftBodyInternals.h). applyRepulsionForce has
  // already run in this step, and the lists are cleared before it runs again. So only applications
  // read them.
  for (const StepContact& contact : contacts) {
    btSoftBody* const node_body = btSoftBody::upcast(contact.body_a);
    if (!node_body || contact.kind != ContactKind::vertex_face) continue;
    if (!contact.face) {
      auto rigid = rigid_contact<btSoftBody::DeformableNodeRigidContact>(contact, *node_body);
      rigid.m_c5.setIdentity();
      node_body->m_nodeRigidContacts.push_back(rigid);
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
