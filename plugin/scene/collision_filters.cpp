#include "scene/collision_filters.h"

#include <functional>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

bool ignores(const btCollisionObject& a, const btCollisionObject& b) {
  if (!a.checkCollideWith(&b)) return true;
  const btSoftBody* soft = btSoftBody::upcast(&a);
  return soft && soft->m_collisionDisabledObjects.findLinearSearch(&b) !=
                     soft->m_collisionDisabledObjects.size();
}

// True if the application's filter accepts the pair, or if there is none.
bool passes_filter(btSoftBody& a, btCollisionObject& b) {
  btOverlapFilterCallback* filter = overlap_filter(a);
  btBroadphaseProxy* proxy_a = a.getBroadphaseHandle();
  btBroadphaseProxy* proxy_b = b.getBroadphaseHandle();
  return !filter || !proxy_a || !proxy_b || filter->needBroadphaseCollision(proxy_a, proxy_b);
}

}  // namespace

btOverlapFilterCallback* overlap_filter(const btSoftBody& body) {
  btBroadphaseInterface* broadphase = body.m_worldInfo ? body.m_worldInfo->m_broadphase : nullptr;
  btOverlappingPairCache* pairs = broadphase ? broadphase->getOverlappingPairCache() : nullptr;
  return pairs ? pairs->getOverlapFilterCallback() : nullptr;
}

bool is_cluster_pair(const btSoftBody& a, const btSoftBody& b) {
  const int common = a.m_cfg.collisions & b.m_cfg.collisions & btSoftBody::fCollision::SVSmask;
  return common == btSoftBody::fCollision::CL_SS;
}

bool has_pair_rules(btSoftBody& body) {
  return body.getNumObjectsWithoutCollision() > 0 || body.m_collisionDisabledObjects.size() > 0 ||
         (body.m_cfg.collisions & btSoftBody::fCollision::CL_SS);
}

bool may_collide(btSoftBody& a, btSoftBody& b) {
  return !ignores(a, b) && !ignores(b, a) && !is_cluster_pair(a, b) && passes_filter(a, b);
}

bool may_collide(btSoftBody& a, btCollisionObject& b) {
  return !ignores(a, b) && !ignores(b, a) && passes_filter(a, b);
}

std::uint64_t hash_of_ignored(btCollisionObject& body) {
  std::uint64_t hash = 0;
  const auto mix = [&hash](const void* object) {
    hash = (hash ^ std::hash<const void*>()(object)) * 0x9e3779b97f4a7c15u + 1;
  };
  for (int i = 0; i < body.getNumObjectsWithoutCollision(); ++i) {
    mix(body.getObjectWithoutCollision(i));
  }
  if (const btSoftBody* soft = btSoftBody::upcast(&body)) {
    for (int i = 0; i < soft->m_collisionDisabledObjects.size(); ++i) {
      mix(soft->m_collisionDisabledObjects[i]);
    }
  }
  return hash;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
