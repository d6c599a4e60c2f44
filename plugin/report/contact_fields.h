// What Bullet's contacts of both worlds have in common.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <new>
#include <set>

#include "lazyccd/bullet/report.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Bullet 3.25 has the impulse in a contact, from the soft on the rigid body, N s.
template <class Info>
auto set_impulse(Info& info, const btVector3& impulse, int) -> decltype(info.m_impulse, void()) {
  info.m_impulse = impulse;
}
template <class Info>
void set_impulse(Info&, const btVector3&, long) {}

/// Appends a contact of a node or a face with a rigid body, which is body_b. Both worlds name these
/// members alike. It is made in its place: a copy would be of some 800 bytes and 18 arrays.
template <class RigidContact>
RigidContact& append_rigid_contact(const StepContact& contact, const btSoftBody& body,
                                   btAlignedObjectArray<RigidContact>& list) {
  RigidContact& rigid = *::new (&list.expandNonInitializing()) RigidContact;
  rigid.m_cti.m_colObj = contact.body_b;
  rigid.m_cti.m_normal = contact.normal;
  rigid.m_cti.m_offset = -contact.normal.dot(contact.point);
  set_impulse(rigid.m_cti, -contact.impulse * contact.normal - contact.friction_impulse, 0);
  rigid.m_c0.setIdentity();
  rigid.m_c1 = contact.point - contact.body_b->getWorldTransform().getOrigin();
  rigid.m_c2 = rigid.m_c4 = 0;
  rigid.m_c3 = body.m_cfg.kDF * contact.body_b->getFriction();
  btPlaneSpace1(contact.normal, rigid.t1, rigid.t2);
  return rigid;
}

/// Weights of the face's corners.
inline btVector3 face_weights(const StepContact& contact) {
  return btVector3(static_cast<btScalar>(-contact.weights[1]),
                   static_cast<btScalar>(-contact.weights[2]),
                   static_cast<btScalar>(-contact.weights[3]));
}

/// The sleeping bodies with contacts in this step. Their lists are those of an old step.
inline std::set<btSoftBody*> sleepers_with(Span<const StepContact> contacts) {
  std::set<btSoftBody*> bodies;
  for (const StepContact& contact : contacts) {
    for (btCollisionObject* const object : {contact.body_a, contact.body_b}) {
      btSoftBody* const body = btSoftBody::upcast(object);
      if (body && !body->isActive()) bodies.insert(body);
    }
  }
  return bodies;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
