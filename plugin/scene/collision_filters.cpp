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

// Layers. Every soft body is in `soft_body`; the others stand for what its flags ask for.
constexpr std::uint32_t soft_body = 1, vertex_face_soft = 2, vertex_face_deformable = 4,
                        rigid_body = 8, multibody_link = 16;

}  // namespace

CollisionLayers CollisionFlags::layers_of(const btSoftBody& body) const {
  using Flag = btSoftBody::fCollision;
  const int flags = body.m_cfg.collisions;
  const auto has = [flags](int flag) { return (flags & flag) != 0; };
  CollisionLayers layers;
  if (!obey_ || has(Flag::VF_SS)) layers.mask |= vertex_face_soft;
  if (!obey_ || has(Flag::VF_DD)) layers.mask |= vertex_face_deformable;
  layers.layer = soft_body | layers.mask;
  if (has(Flag::CL_RS)) return layers;
  const bool all = !obey_ || has(Flag::SDF_RS) || (has(Flag::SDF_RD) && has(Flag::SDF_RDN));
  if (all || (has(Flag::SDF_RD) && has(Flag::SDF_RDF))) layers.mask |= rigid_body;
  if (all || (has(Flag::SDF_RD) && has(Flag::SDF_MDF))) layers.mask |= multibody_link;
  return layers;
}

CollisionLayers CollisionFlags::layers_of(const btCollisionObject& rigid) {
  const bool is_link = rigid.getInternalType() == btCollisionObject::CO_FEATHERSTONE_LINK;
  return {is_link ? multibody_link : rigid_body, soft_body};
}

bool CollisionFlags::ask_for_rigid(const btSoftBody& body) const {
  return (layers_of(body).mask & (rigid_body | multibody_link)) != 0;
}

bool CollisionFlags::ask_for(const btSoftBody& body, const btCollisionObject& rigid) const {
  return (layers_of(body).mask & layers_of(rigid).layer) != 0;
}

bool CollisionFlags::ask_for(const btSoftBody& a, const btSoftBody& b) const {
  return (layers_of(a).mask & layers_of(b).mask & (vertex_face_soft | vertex_face_deformable)) != 0;
}

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
