#include "bodies/body_forces.h"

#include <BulletSoftBody/btDeformableCorotatedForce.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>

#include <algorithm>
#include <functional>
#include <typeinfo>
#include <utility>

#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Force = btDeformableLagrangianForce;

// Makes `to` a copy of `from` that acts on no body. Returns false if the class of `from` is not
// Known itself.
template <class Known>
bool copy_as(const Force& from, std::unique_ptr<Force>& to) {
  if (typeid(from) != typeid(Known)) return false;
  const Known& known = static_cast<const Known&>(from);
  Force* const old = to.get();
  if (old != nullptr && typeid(*old) == typeid(Known)) {
    static_cast<Known&>(*old) = known;
  } else {
    to = std::make_unique<Known>(known);
  }
  to->m_softBodies.resizeNoInitialize(0);
  return true;
}

bool copy(const Force& from, std::unique_ptr<Force>& to) {
  return copy_as<btDeformableMassSpringForce>(from, to) ||
         copy_as<btDeformableGravityForce>(from, to) ||
         copy_as<btDeformableLinearElasticityForce>(from, to) ||
         copy_as<btDeformableNeoHookeanForce>(from, to) ||
         copy_as<btDeformableCorotatedForce>(from, to);
}

}  // namespace

bool BodyForces::read(const Forces& forces, const btAlignedObjectArray<btSoftBody*>& bodies) {
  const auto count = static_cast<std::size_t>(bodies.size());
  on_.resize(count);
  ScratchVector<std::size_t> found(count, 0);  // by body: forces on it
  ScratchVector<std::pair<const btSoftBody*, std::size_t>> indices;
  for (std::size_t i = 0; i < count; ++i) indices.push_back({bodies[static_cast<int>(i)], i});
  std::sort(indices.begin(), indices.end(),
            [](const auto& x, const auto& y) { return std::less<>()(x.first, y.first); });
  without_bodies_.resize(static_cast<std::size_t>(forces.size()));
  for (int f = 0; f < forces.size(); ++f) {
    std::unique_ptr<Force>& without_bodies = without_bodies_[static_cast<std::size_t>(f)];
    if (!copy(*forces[f], without_bodies)) return false;
    for (int i = 0; i < forces[f]->m_softBodies.size(); ++i) {
      btSoftBody* const body = forces[f]->m_softBodies[i];
      if (!body->isActive()) continue;
      const auto index = std::lower_bound(
          indices.begin(), indices.end(), body,
          [](const auto& entry, const btSoftBody* b) { return std::less<>()(entry.first, b); });
      if (index == indices.end() || index->first != body) return false;
      std::vector<Acting>& on_body = on_[index->second];
      std::size_t& next = found[index->second];
      if (next == on_body.size()) on_body.emplace_back();
      Acting& acting = on_body[next++];
      acting.force = f;
      copy(*without_bodies, acting.copy);
      acting.copy->addSoftBody(body);
    }
  }
  for (std::size_t i = 0; i < count; ++i) on_[i].resize(found[i]);
  return true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
