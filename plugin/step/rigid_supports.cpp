#include "step/rigid_supports.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <limits>
#include <unordered_map>
#include <vector>

#include "scene/rigid_poses.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Contacts from a body to the nearest body that impulses do not move. Bodies that none leads to are
// not in it.
using Levels = std::unordered_map<const btCollisionObject*, int>;
using Manifolds = std::vector<const btPersistentManifold*>;

bool carries_load(const btPersistentManifold& manifold) {
  for (int i = 0; i < manifold.getNumContacts(); ++i)
    if (manifold.getContactPoint(i).m_appliedImpulse > 0) return true;
  return false;
}

// `islands`: Bullet's tags of those that count, sorted. Static bodies are in none.
Manifolds loaded_manifolds(btDispatcher& dispatcher, const std::vector<int>& islands) {
  const auto counts = [&islands](const btCollisionObject& object) {
    return std::binary_search(islands.begin(), islands.end(), object.getIslandTag());
  };
  Manifolds loaded;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* const manifold = dispatcher.getManifoldByIndexInternal(i);
    const btCollisionObject &first = *manifold->getBody0(), &second = *manifold->getBody1();
    if ((counts(first) || counts(second)) && first.hasContactResponse() &&
        second.hasContactResponse() && carries_load(*manifold))
      loaded.push_back(manifold);
  }
  return loaded;
}

// Breadth first, from static and kinematic bodies upward.
Levels find_levels(const Manifolds& loaded) {
  std::unordered_map<const btCollisionObject*, std::vector<const btCollisionObject*>> neighbours;
  Levels levels;
  std::vector<const btCollisionObject*> next;
  const auto add = [&](const btCollisionObject* object, const btCollisionObject* neighbour) {
    neighbours[object].push_back(neighbour);
    if (!is_movable(*object) && levels.insert({object, 0}).second) next.push_back(object);
  };
  for (const btPersistentManifold* const manifold : loaded) {
    add(manifold->getBody0(), manifold->getBody1());
    add(manifold->getBody1(), manifold->getBody0());
  }
  for (std::size_t i = 0; i < next.size(); ++i) {
    const int level = levels.at(next[i]) + 1;
    for (const btCollisionObject* const above : neighbours.at(next[i]))
      if (levels.insert({above, level}).second) next.push_back(above);
  }
  return levels;
}

// `sign`: -1 if the body is the manifold's second one, as its normals point to the first one.
void add_supports(const btPersistentManifold& manifold, double sign, double dt, RigidMotion& body) {
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    if (!(point.m_appliedImpulse > 0 || point.getDistance() <= 0)) continue;
    const btVector3& at = sign > 0 ? point.m_positionWorldOnA : point.m_positionWorldOnB;
    const btVector3 friction = point.m_appliedImpulseLateral1 * point.m_lateralFrictionDir1 +
                               point.m_appliedImpulseLateral2 * point.m_lateralFrictionDir2;
    Support support;
    support.normal = sign * to_double(point.m_normalWorldOnB);
    support.arm = to_double(at) - body.centre();
    support.load = dt * std::max(0.0, static_cast<double>(point.m_appliedImpulse));
    support.friction_impulse = sign * dt * to_double(friction);
    support.friction = static_cast<double>(point.m_combinedFriction);
    support.slides = !(support.friction > 0);
    body.supports.push_back(support);
  }
}

}  // namespace

void find_supports(btDispatcher& dispatcher, Motion& motion) {
  std::unordered_map<const btCollisionObject*, RigidMotion*> bodies;
  std::vector<int> islands;
  for (RigidMotion& body : motion.rigid) {
    body.supports.clear();
    body.supported_mobility.reset();
    if (!body.is_dynamic()) continue;
    bodies.insert({body.object, &body});
    islands.push_back(body.object->getIslandTag());
  }
  if (bodies.empty()) return;
  std::sort(islands.begin(), islands.end());
  const Manifolds loaded = loaded_manifolds(dispatcher, islands);
  const Levels levels = find_levels(loaded);
  const auto level_of = [&levels](const btCollisionObject* object) {
    const auto found = levels.find(object);
    return found == levels.end() ? std::numeric_limits<int>::max() : found->second;
  };
  for (const btPersistentManifold* const manifold : loaded) {
    const btCollisionObject *first = manifold->getBody0(), *second = manifold->getBody1();
    const int first_level = level_of(first), second_level = level_of(second);
    const auto body = bodies.find(first_level > second_level ? first : second);
    if (first_level == second_level || body == bodies.end()) continue;
    add_supports(*manifold, first_level > second_level ? 1 : -1, motion.dt, *body->second);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
