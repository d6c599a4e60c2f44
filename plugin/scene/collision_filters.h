// Bullet's rules for which pairs with a soft body collide, besides filter groups and masks.
#pragma once

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Bullet's collision flags (btSoftBody::fCollision) as layers of the detector (Body::layer).
struct CollisionLayers {
  std::uint32_t layer = 0, mask = 0;

  /// Copies them into a filter of the detector.
  void set(Body& filter) const {
    filter.layer = layer;
    filter.layer_mask = mask;
  }
};

/// Whether two filters are the same.
inline bool are_equal_filters(const Body& a, const Body& b) {
  return a.group == b.group && a.mask == b.mask && a.self_collision == b.self_collision &&
         a.layer == b.layer && a.layer_mask == b.layer_mask;
}

/// Which pairs the collision flags of soft bodies ask for. Two soft bodies collide if both have
/// VF_SS or both have VF_DD. A soft body collides with everything rigid if it has SDF_RS; with
/// SDF_RD and SDF_RDN too; with SDF_RD and SDF_RDF with rigid bodies, with SDF_RD and SDF_MDF with
/// links of multibodies. CL_RS and CL_SS (clusters) are Bullet's own.
class CollisionFlags {
 public:
  /// `obey`: as SolverOptions::obey_collision_flags. False: all flags above count as set.
  explicit CollisionFlags(bool obey) : obey_(obey) {}

  CollisionLayers layers_of(const btSoftBody& body) const;
  static CollisionLayers layers_of(const btCollisionObject& rigid);
  /// True if the flags let the soft body collide with something rigid.
  bool ask_for_rigid(const btSoftBody& body) const;
  /// True if the flags let the soft body collide with anything.
  bool ask_for_any(const btSoftBody& body) const { return layers_of(body).mask != 0; }
  bool ask_for(const btSoftBody& body, const btCollisionObject& rigid) const;
  bool ask_for(const btSoftBody& a, const btSoftBody& b) const;

 private:
  bool obey_;
};

/// The application's own broad phase filter, or null. If there is one, it alone decides: groups and
/// masks do not count (btOverlappingPairCache.h, needsBroadphaseCollision).
btOverlapFilterCallback* overlap_filter(const btSoftBody& body);

/// True if CL_SS (cluster against cluster) is the only soft-soft flag that both bodies have. Such a
/// pair stays with Bullet.
bool is_cluster_pair(const btSoftBody& a, const btSoftBody& b);

/// False if only groups and masks can exclude a pair with this body.
bool has_pair_rules(btSoftBody& body);

/// Applies all rules except groups and masks, which the detector checks itself.
bool may_collide(btSoftBody& a, btSoftBody& b);
bool may_collide(btSoftBody& a, btCollisionObject& b);

/// Hash of the list of objects that a body ignores. Used to notice changes of the list.
std::uint64_t hash_of_ignored(btCollisionObject& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
