#include "bodies/deformable_motion.h"

#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

DeformableBodies::DeformableBodies(const SideBySide::Bodies& all, const SideBySide& visitor)
    : bodies(all), side_by_side(visitor) {
  int next = 0;
  for (int i = 0; i < all.size(); ++i) {
    first_node.push_back(next);
    next += all[i]->m_nodes.size();
  }
}

bool moves_alone(const btSoftBody& body) {
  for (int i = 0; i < body.m_deformableAnchors.size(); ++i)
    if (index_of(body, body.m_deformableAnchors[i].m_node) < 0) return false;
  const bool reads_faces = !body.m_fdbvt.empty() || body.m_fdbvnt || body.m_bUpdateRtCst;
  return has_own_links(body) && has_own_tetrahedra(body) && (!reads_faces || has_own_faces(body));
}

void apply_explicit_forces(const DeformableBodies& all, const BodyForces& forces, btScalar dt,
                           VectorStack& force) {
  all.side_by_side.for_each([&](int b) {
    btSoftBody& body = *all.bodies[b];
    const int first = all.first_node[static_cast<std::size_t>(b)];
    body.advanceDeformation();
    for (const BodyForces::Acting& acting : forces.on(b))
      acting.copy->addScaledExplicitForce(dt, force);
    const bool is_active = body.isActive();
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      if (is_active) {
        if (node.m_im > 0) node.m_effectiveMass_inv = node.m_effectiveMass.inverse();
        node.m_v += node.m_im * force[first + i];
      }
      force[first + i].setZero();
    }
  });
}

void read_velocity_changes(const DeformableBodies& all, const VectorStack& backup,
                           VectorStack& dv) {
  all.side_by_side.for_each([&](int b) {
    btSoftBody& body = *all.bodies[b];
    if (!body.isActive()) return;
    const int first = all.first_node[static_cast<std::size_t>(b)];
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      dv[first + i] = node.m_v + node.m_splitv - backup[first + i];
      node.m_v = backup[first + i];
    }
  });
}

void update_velocities(const DeformableBodies& all, const VectorStack& backup, VectorStack& dv) {
  all.side_by_side.for_each([&](int b) {
    btSoftBody& body = *all.bodies[b];
    const int first = all.first_node[static_cast<std::size_t>(b)];
    body.m_maxSpeedSquared = 0;
    if (!body.isActive()) return;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      btVector3& change = dv[first + i];
      if (change != change) change.setZero();  // not a number
      node.m_v = backup[first + i] + change - node.m_splitv;
      body.m_maxSpeedSquared = btMax(body.m_maxSpeedSquared, node.m_v.length2());
    }
  });
}

void find_largest_speeds(const DeformableBodies& all) {
  all.side_by_side.for_each([&](int b) {
    btSoftBody& body = *all.bodies[b];
    if (!body.isActive()) return;
    body.m_maxSpeedSquared = 0;
    for (int i = 0; i < body.m_nodes.size(); ++i)
      body.m_maxSpeedSquared = btMax(body.m_maxSpeedSquared, body.m_nodes[i].m_v.length2());
  });
}

void apply_transforms(const DeformableBodies& all, btScalar dt) {
  all.side_by_side.for_each([&](int b) {
    btSoftBody& body = *all.bodies[b];
    const btScalar limit = body.getWorldInfo()->m_maxDisplacement / dt;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      for (int k = 0; k < 3; ++k) {
        if (node.m_v[k] > limit) node.m_v[k] = limit;
        if (node.m_v[k] < -limit) node.m_v[k] = -limit;
      }
      node.m_x = node.m_x + dt * (node.m_v + node.m_splitv);
      node.m_q = node.m_x;
      node.m_vn = node.m_v;
    }
    for (int i = 0; i < body.m_deformableAnchors.size(); ++i) {
      const btSoftBody::DeformableNodeRigidAnchor& anchor = body.m_deformableAnchors[i];
      anchor.m_node->m_x = anchor.m_cti.m_colObj->getWorldTransform() * anchor.m_local;
    }
    body.interpolateRenderMesh();
  });
}

bool is_anchored_to_link(const btSoftBody& body) {
  for (int i = 0; i < body.m_deformableAnchors.size(); ++i)
    if (body.m_deformableAnchors[i].m_cti.m_colObj->getInternalType() ==
        btCollisionObject::CO_FEATHERSTONE_LINK)
      return true;
  return false;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
