#include "step/rigid_supports.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "scene/rigid_poses.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Object = const btCollisionObject*;
using Manifolds = ScratchVector<const btPersistentManifold*>;

bool carries_load(const btPersistentManifold& manifold) {
  for (int i = 0; i < manifold.getNumContacts(); ++i)
    if (manifold.getContactPoint(i).m_appliedImpulse > 0) return true;
  return false;
}

// `islands`: Bullet's tags of those that count, sorted. Static bodies are in none.
Manifolds loaded_manifolds(btDispatcher& dispatcher, Span<const int> islands) {
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

// How many contacts lead from a body to the nearest one that impulses do not move.
class Levels {
 public:
  explicit Levels(const Manifolds& loaded) {
    for (const btPersistentManifold* const manifold : loaded) {
      neighbours_.push_back({manifold->getBody0(), manifold->getBody1()});
      neighbours_.push_back({manifold->getBody1(), manifold->getBody0()});
    }
    std::sort(neighbours_.begin(), neighbours_.end(), is_before);
    for (const Pair& pair : neighbours_)
      if (objects_.empty() || objects_.back() != pair.first) objects_.push_back(pair.first);
    levels_.assign(objects_.size(), none);
    find();
  }

  /// `none` for a body from which no contacts lead there.
  int of(Object object) const {
    const auto found = std::lower_bound(objects_.begin(), objects_.end(), object, std::less<>());
    return found != objects_.end() && *found == object ? levels_[index_of(found)] : none;
  }

 private:
  using Pair = std::pair<Object, Object>;
  using Objects = ScratchVector<Object>;
  static constexpr int none = std::numeric_limits<int>::max();

  static bool is_before(const Pair& x, const Pair& y) { return std::less<>()(x.first, y.first); }
  std::size_t index_of(Objects::const_iterator object) const {
    return static_cast<std::size_t>(object - objects_.begin());
  }

  // Breadth first, from static and kinematic bodies upward.
  void find() {
    Objects next;
    for (auto object = objects_.begin(); object != objects_.end(); ++object) {
      if (is_movable(**object)) continue;
      levels_[index_of(object)] = 0;
      next.push_back(*object);
    }
    for (std::size_t i = 0; i < next.size(); ++i) {
      const int level = of(next[i]) + 1;
      const auto range = std::equal_range(neighbours_.begin(), neighbours_.end(),
                                          Pair(next[i], nullptr), is_before);
      for (auto pair = range.first; pair != range.second; ++pair) {
        const auto above =
            std::lower_bound(objects_.cbegin(), objects_.cend(), pair->second, std::less<>());
        if (levels_[index_of(above)] != none) continue;
        levels_[index_of(above)] = level;
        next.push_back(*above);
      }
    }
  }

  ScratchVector<Pair> neighbours_;  // bodies that touch, in both orders; sorted
  Objects objects_;                 // sorted
  ScratchVector<int> levels_;       // by object
};

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
  ScratchVector<std::pair<Object, RigidMotion*>> bodies;
  ScratchVector<int> islands;
  for (RigidMotion& body : motion.rigid) {
    body.supports.clear();
    body.supported_mobility.reset();
    if (!body.is_dynamic()) continue;
    bodies.push_back({body.object, &body});
    islands.push_back(body.object->getIslandTag());
  }
  if (bodies.empty()) return;
  std::sort(bodies.begin(), bodies.end(),
            [](const auto& x, const auto& y) { return std::less<>()(x.first, y.first); });
  std::sort(islands.begin(), islands.end());
  const Manifolds loaded = loaded_manifolds(dispatcher, islands);
  const Levels levels(loaded);
  for (const btPersistentManifold* const manifold : loaded) {
    const Object first = manifold->getBody0(), second = manifold->getBody1();
    const int first_level = levels.of(first), second_level = levels.of(second);
    const Object above = first_level > second_level ? first : second;
    const auto body = std::lower_bound(
        bodies.begin(), bodies.end(), above,
        [](const auto& entry, Object object) { return std::less<>()(entry.first, object); });
    if (first_level == second_level || body == bodies.end() || body->first != above) continue;
    add_supports(*manifold, first_level > second_level ? 1 : -1, motion.dt, *body->second);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
