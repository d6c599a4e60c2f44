#include "step/write_rigid_bodies.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <vector>

#include "motion/articulated_motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void write_rigid_bodies(const StepTopology& topology, const Motion& motion) {
  for (const StepTopology::BodyRecord& record : topology.bodies()) {
    if (record.soft) continue;
    const RigidMotion& rigid = motion.rigid_of(topology.index_of(record));
    const bool changed = !rigid.velocity_change.isZero() ||
                         !rigid.angular_velocity_change.isZero() || !rigid.load_velocity.isZero() ||
                         !rigid.load_angular_velocity.isZero() || !(rigid.end == rigid.predicted);
    if (!rigid.is_dynamic() || !changed) continue;
    btRigidBody* body = btRigidBody::upcast(record.object);
    body->setLinearVelocity(body->getLinearVelocity() + to_bullet(rigid.velocity_change));
    body->setAngularVelocity(body->getAngularVelocity() + to_bullet(rigid.angular_velocity_change));
    // Also sets the velocity with which Bullet interpolates poses. Supports resist what follows.
    body->setCenterOfMassTransform(rigid.end);
    body->setLinearVelocity(body->getLinearVelocity() + to_bullet(rigid.load_velocity));
    body->setAngularVelocity(body->getAngularVelocity() + to_bullet(rigid.load_angular_velocity));
    body->activate(true);
  }
  for (const ArticulatedMotion& articulated : motion.articulated) {
    if (!articulated.is_changed()) continue;
    std::vector<btScalar> change(articulated.velocity_change.size());
    std::transform(articulated.velocity_change.begin(), articulated.velocity_change.end(),
                   change.begin(), [](double x) { return static_cast<btScalar>(x); });
    articulated.body->applyDeltaVeeMultiDof(change.data(), 1);
    articulated.body->wakeUp();
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
