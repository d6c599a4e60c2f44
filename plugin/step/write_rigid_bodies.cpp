#include "step/write_rigid_bodies.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void write_rigid_bodies(const StepTopology& topology, const Motion& motion) {
  for (const StepTopology::BodyRecord& record : topology.bodies()) {
    if (record.soft) continue;
    const RigidMotion& rigid = motion.rigid_of(topology.index_of(record));
    const bool changed = !rigid.velocity_change.isZero(0) ||
                         !rigid.angular_velocity_change.isZero(0) ||
                         !(rigid.end == rigid.predicted);
    if (!rigid.is_dynamic() || !changed) continue;
    btRigidBody* body = btRigidBody::upcast(record.object);
    body->setCenterOfMassTransform(rigid.end);
    body->setLinearVelocity(body->getLinearVelocity() + to_bullet(rigid.velocity_change));
    body->setAngularVelocity(body->getAngularVelocity() + to_bullet(rigid.angular_velocity_change));
    body->activate(true);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
