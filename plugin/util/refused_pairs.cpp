#include "util/refused_pairs.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btEmptyCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletSoftBody/btSoftBodyConcaveCollisionAlgorithm.h>
#include <BulletSoftBody/btSoftRigidCollisionAlgorithm.h>
#include <BulletSoftBody/btSoftSoftCollisionAlgorithm.h>

#include <algorithm>
#include <cstring>
#include <typeinfo>

#include "lazyccd/bullet/collision_algorithm.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// By name: with two copies of Bullet in a process, the type may be the other copy's.
template <class... Types, class Object>
bool is_any_of(const Object& object) {
  const char* const name = typeid(object).name();
  return (... || (std::strcmp(name, typeid(Types).name()) == 0));
}

// Bullet's algorithms that bring a pair to the solver in each step.
bool brings_pair(const btCollisionAlgorithm& algorithm) {
  return is_any_of<btSoftRigidCollisionAlgorithm, btSoftSoftCollisionAlgorithm,
                   btLazySoftSoftCollisionAlgorithm>(algorithm);
}

// Bullet's algorithms that bring only pairs with a child or triangle that is near, or none.
bool brings_parts(const btCollisionAlgorithm& algorithm) {
  return is_any_of<btSoftBodyConcaveCollisionAlgorithm, btCompoundCollisionAlgorithm,
                   btGImpactCollisionAlgorithm, btEmptyAlgorithm>(algorithm);
}

// True if the dispatcher's class or its near callback is the application's.
bool is_own_dispatcher(const btDispatcher& dispatcher) {
  const auto* const bullets = dynamic_cast<const btCollisionDispatcher*>(&dispatcher);
  if (!bullets || !is_any_of<btCollisionDispatcher, btCollisionDispatcherMt>(dispatcher))
    return true;
  // The default callback of another copy of Bullet is not known.
  const std::type_info &type = typeid(dispatcher), &single = typeid(btCollisionDispatcher),
                       &threaded = typeid(btCollisionDispatcherMt);
  return (&type == &single || &type == &threaded) &&
         bullets->getNearCallback() != btCollisionDispatcher::defaultNearCallback;
}

btOverlappingPairCache* pair_cache(const btSoftBodyWorldInfo* world) {
  btBroadphaseInterface* const broadphase = world ? world->m_broadphase : nullptr;
  return broadphase ? broadphase->getOverlappingPairCache() : nullptr;
}

const btCollisionObject& object_of(const btBroadphaseProxy& proxy) {
  return *static_cast<const btCollisionObject*>(proxy.m_clientObject);
}

// Makes the dispatcher choose an algorithm for the pair, in this order.
bool has_own_algorithm(btDispatcher& dispatcher, const btCollisionObject& a,
                       const btCollisionObject& b) {
  const auto wrap = [](const btCollisionObject& object) {
    return btCollisionObjectWrapper(nullptr, object.getCollisionShape(), &object,
                                    object.getWorldTransform(), -1, -1);
  };
  const btCollisionObjectWrapper wrap_a = wrap(a), wrap_b = wrap(b);
  btCollisionAlgorithm* const algorithm =
      dispatcher.findAlgorithm(&wrap_a, &wrap_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  if (!algorithm) return false;
  const bool is_own = !brings_pair(*algorithm) && !brings_parts(*algorithm);
  algorithm->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(algorithm);
  return is_own;
}

}  // namespace

RefusedPairs::Pair RefusedPairs::pair_of(const btCollisionObject& a, const btCollisionObject& b) {
  const auto id_of = [](const btCollisionObject& object) {
    const btBroadphaseProxy* const proxy = object.getBroadphaseHandle();
    return proxy ? proxy->m_uniqueId : -1;
  };
  return std::minmax(id_of(a), id_of(b));
}

void RefusedPairs::begin_step(const btAlignedObjectArray<btSoftBody*>& bodies, bool is_own_solver) {
  const btSoftBodyWorldInfo* const world = bodies.size() > 0 ? bodies[0]->m_worldInfo : nullptr;
  if (world != world_) has_own_algorithm_ = false;
  world_ = world;
  const btDispatcher* const dispatcher = world ? world->m_dispatcher : nullptr;
  is_on_ = pair_cache(world) &&
           (is_own_solver || has_own_algorithm_ || (dispatcher && is_own_dispatcher(*dispatcher)));
  accepted_.clear();
}

void RefusedPairs::accept(const btCollisionObject& a, const btCollisionObject& b) {
  if (!is_on_) return;
  const Pair pair = pair_of(a, b);
  const std::lock_guard<std::mutex> lock(mutex_);
  // A mesh brings the same pair for each triangle.
  if (accepted_.empty() || accepted_.back() != pair) accepted_.push_back(pair);
}

void RefusedPairs::end_dispatch() {
  std::set<Pair> refused, at_rest;
  std::sort(accepted_.begin(), accepted_.end());
  const int count = is_on_ ? pair_cache(world_)->getNumOverlappingPairs() : 0;
  const btBroadphasePair* const pairs =
      count > 0 ? pair_cache(world_)->getOverlappingPairArrayPtr() : nullptr;
  for (int i = 0; i < count; ++i) {
    const btCollisionObject &a = object_of(*pairs[i].m_pProxy0),
                            &b = object_of(*pairs[i].m_pProxy1);
    if (!btSoftBody::upcast(&a) && !btSoftBody::upcast(&b)) continue;
    const Pair ids = pair_of(a, b);
    if (is_refused(pairs[i], ids)) refused.insert(ids);
    if (!a.isActive() && !b.isActive()) at_rest.insert(ids);
  }
  is_changed_ = refused != refused_;
  refused_ = std::move(refused);
  at_rest_ = std::move(at_rest);
}

bool RefusedPairs::is_refused(const btBroadphasePair& pair, const Pair& ids) const {
  if (std::binary_search(accepted_.begin(), accepted_.end(), ids)) return false;
  // Bullet does not dispatch what sleeps, so the last answer holds. What slept then may have been
  // woken after the dispatch.
  const bool slept = at_rest_.count(ids) > 0 || (!object_of(*pair.m_pProxy0).isActive() &&
                                                 !object_of(*pair.m_pProxy1).isActive());
  if (slept) return refused_.count(ids) > 0;
  const auto is_plane = [](const btBroadphaseProxy& proxy) {
    return object_of(proxy).getCollisionShape()->getShapeType() == STATIC_PLANE_PROXYTYPE;
  };
  // A plane has triangles everywhere, so it comes in each step.
  return !pair.m_algorithm || !brings_parts(*pair.m_algorithm) || is_plane(*pair.m_pProxy0) ||
         is_plane(*pair.m_pProxy1);
}

void RefusedPairs::look_for_algorithm(const btSoftBody& soft, const btCollisionObject& other) {
  btDispatcher* const dispatcher = world_ ? world_->m_dispatcher : nullptr;
  // A compound chooses an algorithm for each child.
  if (has_own_algorithm_ || !dispatcher || other.getCollisionShape()->isCompound()) return;
  has_own_algorithm_ =
      has_own_algorithm(*dispatcher, soft, other) || has_own_algorithm(*dispatcher, other, soft);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
