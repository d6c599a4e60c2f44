#include "step/rigid_supports.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <cstdlib>
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
    for (const btPersistentManifold* const manifold : loaded)
      for (const Object object : {manifold->getBody0(), manifold->getBody1()})
        levels_.push_back({object, is_movable(*object) ? none : 0});
    std::sort(levels_.begin(), levels_.end(), is_before);
    levels_.erase(std::unique(levels_.begin(), levels_.end()), levels_.end());
    for (bool any = true; any;) {  // once for each level
      any = false;
      for (const btPersistentManifold* const manifold : loaded) {
        int &first = of(manifold->getBody0()), &second = of(manifold->getBody1());
        any = any || std::abs(first - second) > 1;
        first = std::min(first, second + 1);
        second = std::min(second, first + 1);
      }
    }
  }

  /// Of a body of these manifolds. The same large number where no contacts lead there.
  int& of(Object object) {
    return std::lower_bound(levels_.begin(), levels_.end(), Level(object, 0), is_before)->second;
  }

 private:
  using Level = std::pair<Object, int>;
  static constexpr int none = std::numeric_limits<int>::max() - 1;
  static bool is_before(const Level& x, const Level& y) { return std::less<>()(x.first, y.first); }

  ScratchVector<Level> levels_;  // sorted
};

// `sign`: -1 if the body is the manifold's second one, as its normals point to the first one.
void add_supports(const btPersistentManifold& manifold, double sign, double dt,
                  const Vector3d& centre, ScratchVector<Support>& supports) {
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    if (!(point.m_appliedImpulse > 0 || point.getDistance() <= 0)) continue;
    const btVector3& at = sign > 0 ? point.m_positionWorldOnA : point.m_positionWorldOnB;
    const btVector3 friction = point.m_appliedImpulseLateral1 * point.m_lateralFrictionDir1 +
                               point.m_appliedImpulseLateral2 * point.m_lateralFrictionDir2;
    Support support;
    support.normal = sign * to_double(point.m_normalWorldOnB);
    support.arm = to_double(at) - centre;
    support.load = dt * std::max(0.0, static_cast<double>(point.m_appliedImpulse));
    support.friction_impulse = sign * dt * to_double(friction);
    support.friction = static_cast<double>(point.m_combinedFriction);
    support.slides = !(support.friction > 0);
    supports.push_back(support);
  }
}

}  // namespace

void find_supports(btDispatcher& dispatcher, Motion& motion) {
  ScratchVector<std::pair<Object, const RigidMotion*>> bodies;
  ScratchVector<int> islands;
  for (const RigidMotion& body : motion.rigid()) {
    RigidSolution& solution = motion.solution_of(body);
    solution.supports.clear();
    solution.supported_mobility.reset();
    if (!body.is_dynamic()) continue;
    bodies.push_back({body.object, &body});
    islands.push_back(body.object->getIslandTag());
  }
  if (bodies.empty()) return;
  std::sort(bodies.begin(), bodies.end(),
            [](const auto& x, const auto& y) { return std::less<>()(x.first, y.first); });
  std::sort(islands.begin(), islands.end());
  const Manifolds loaded = loaded_manifolds(dispatcher, islands);
  Levels levels(loaded);
  for (const btPersistentManifold* const manifold : loaded) {
    const Object first = manifold->getBody0(), second = manifold->getBody1();
    const int first_level = levels.of(first), second_level = levels.of(second);
    const Object above = first_level > second_level ? first : second;
    const auto body = std::lower_bound(
        bodies.begin(), bodies.end(), above,
        [](const auto& entry, Object object) { return std::less<>()(entry.first, object); });
    if (first_level == second_level || body == bodies.end() || body->first != above) continue;
    add_supports(*manifold, first_level > second_level ? 1 : -1, motion.dt(),
                 body->second->centre(), motion.solution_of(*body->second).supports);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
