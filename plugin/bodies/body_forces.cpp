#include "bodies/body_forces.h"

#include <BulletSoftBody/btDeformableCorotatedForce.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>

#include <functional>
#include <typeinfo>
#include <unordered_map>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Force = btDeformableLagrangianForce;
using MakeCopy = std::function<std::unique_ptr<Force>()>;

// Makes copies that act on no body. Empty if the class of `force` is not Known itself.
template <class Known>
MakeCopy copies_of(const Force& force) {
  if (typeid(force) != typeid(Known)) return {};
  Known without_bodies(static_cast<const Known&>(force));
  without_bodies.m_softBodies.clear();
  return [without_bodies] { return std::make_unique<Known>(without_bodies); };
}

MakeCopy copies_of(const Force& force) {
  using Make = MakeCopy (*)(const Force&);
  for (const Make make :
       {Make(copies_of<btDeformableMassSpringForce>), Make(copies_of<btDeformableGravityForce>),
        Make(copies_of<btDeformableLinearElasticityForce>),
        Make(copies_of<btDeformableNeoHookeanForce>), Make(copies_of<btDeformableCorotatedForce>)})
    if (MakeCopy copies = make(force)) return copies;
  return {};
}

}  // namespace

bool BodyForces::read(const Forces& forces, const btAlignedObjectArray<btSoftBody*>& bodies) {
  on_.clear();
  on_.resize(static_cast<std::size_t>(bodies.size()));
  std::unordered_map<const btSoftBody*, std::size_t> index_of;
  for (int i = 0; i < bodies.size(); ++i) index_of.emplace(bodies[i], static_cast<std::size_t>(i));
  for (int f = 0; f < forces.size(); ++f) {
    const MakeCopy copy = copies_of(*forces[f]);
    if (!copy) return false;
    for (int i = 0; i < forces[f]->m_softBodies.size(); ++i) {
      btSoftBody* const body = forces[f]->m_softBodies[i];
      if (!body->isActive()) continue;
      const auto found = index_of.find(body);
      if (found == index_of.end()) return false;
      on_[found->second].push_back({f, copy()});
      on_[found->second].back().copy->addSoftBody(body);
    }
  }
  return true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
