#include "scenes/worlds/mended_bullet.h"

#include <BulletSoftBody/btSoftBody.h>

namespace lazyccd::scenes {
namespace {

// Returns position or velocity (`of`) of the contact's node relative to its point on the face.
btVector3 relative(const btSoftBody::DeformableFaceNodeContact& contact,
                   btVector3 btSoftBody::Node::*of) {
  btVector3 on_face(0, 0, 0);
  for (int i = 0; i < 3; ++i) on_face += contact.m_bary[i] * (contact.m_face->m_n[i]->*of);
  return contact.m_node->*of - on_face;
}

// Stops the approach of a contact by an inelastic impulse with Coulomb friction.
void stop_approach(const btSoftBody::DeformableFaceNodeContact& contact) {
  if (contact.m_bary[contact.m_bary.minAxis()] < 0) return;
  btScalar mobility = contact.m_node->m_im;
  for (int i = 0; i < 3; ++i)
    mobility += contact.m_bary[i] * contact.m_bary[i] * contact.m_face->m_n[i]->m_im;
  const btVector3 velocity = relative(contact, &btSoftBody::Node::m_v);
  const btScalar approach = -velocity.dot(contact.m_normal);
  if (approach <= 0 || mobility <= 0) return;
  btVector3 change = approach * contact.m_normal;
  const btVector3 sliding = velocity + change;
  const btScalar speed = sliding.length();
  if (speed > 0) change -= btMin(btScalar(1), contact.m_friction * approach / speed) * sliding;
  const btVector3 impulse = change / mobility;
  contact.m_node->m_v += contact.m_node->m_im * impulse;
  for (int i = 0; i < 3; ++i) {
    btSoftBody::Node& node = *contact.m_face->m_n[i];
    node.m_v -= contact.m_bary[i] * node.m_im * impulse;
  }
}

}  // namespace

void MendedSoftBodySolver::solveConstraints(btScalar seconds) {
  btDefaultSoftBodySolver::solveConstraints(seconds);
  for (int b = 0; b < m_softBodySet.size(); ++b) {
    btSoftBody& body = *m_softBodySet[b];
    const btScalar rate = body.m_sst.isdt * (1 - body.m_cfg.kDP);
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_v = (node.m_x - node.m_q) * rate;
    }
  }
}

void MendedDeformableWorld::internalSingleStepSimulation(btScalar seconds) {
  reinitialize(seconds);
  applyRigidBodyGravity(seconds);
  predictUnconstraintMotion(seconds);
  btMultiBodyDynamicsWorld::performDiscreteCollisionDetection();
  btMultiBodyDynamicsWorld::calculateSimulationIslands();
  beforeSolverCallbacks(seconds);
  solveConstraints(seconds);
  afterSolverCallbacks(seconds);
  performDeformableCollisionDetection();
  // Replaces applyRepulsionForce() and performGeometricCollisions(), which calls it again.
  for (int b = 0; b < getSoftBodyArray().size(); ++b) {
    const auto& contacts = getSoftBodyArray()[b]->m_faceNodeContacts;
    for (int i = 0; i < contacts.size(); ++i) stop_approach(contacts[i]);
  }
  integrateTransforms(seconds);
  btMultiBodyDynamicsWorld::updateActions(seconds);
  updateActivationState(seconds);
}

}  // namespace lazyccd::scenes
