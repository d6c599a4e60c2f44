#include "scene/obstacles.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include "scene/collision_filters.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Returns the objects to which nodes are anchored in the deformable world, sorted.
std::vector<const btCollisionObject*> find_anchor_objects(const Obstacles::SoftBodies& bodies) {
  std::vector<const btCollisionObject*> found;
  for (int i = 0; i < bodies.size(); ++i) {
    const auto& anchors = bodies[i]->m_deformableAnchors;
    for (int k = 0; k < anchors.size(); ++k) found.push_back(anchors[k].m_cti.m_colObj);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Returns the bodies to which nodes are anchored in either world, sorted.
std::vector<const btCollisionObject*> find_carriers(const Obstacles::SoftBodies& bodies) {
  std::vector<const btCollisionObject*> found = find_anchor_objects(bodies);
  for (int i = 0; i < bodies.size(); ++i) {
    const auto& anchors = bodies[i]->m_anchors;
    for (int k = 0; k < anchors.size(); ++k) found.push_back(anchors[k].m_body);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Returns bounds, in the body's frame, of all parts of the body that may meet `box` during the
// step. Points of the body move straight from start to end. A point that meets the box started no
// farther from the box than it moves. In between, the body is smaller than at the ends, by the
// cosine of half its rotation angle (`shrink_factor`).
AxisBox in_frame(const Obstacles::Record& record, const AxisBox& box) {
  if (box.is_empty()) return box;
  const AxisBox local = box.transformed(record.start.inverse());
  const btMatrix3x3 basis_change = record.end.getBasis() - record.start.getBasis();
  // Twice the sine of half the rotation angle.
  const btScalar chord = btSqrt(
      (basis_change[0].length2() + basis_change[1].length2() + basis_change[2].length2()) / 2);
  const btScalar shrink_factor =
      btMax(btSqrt(btMax(1 - chord * chord / 4, btScalar(0))), btScalar(0.01));
  const btScalar translation = record.start.getOrigin().distance(record.end.getOrigin());
  btVector3 farthest = local.lower.absolute();
  farthest.setMax(local.upper.absolute());
  const btScalar displacement =
      translation + chord * (farthest.length() + translation) / shrink_factor;
  return local.expanded(btVector3(displacement, displacement, displacement));
}

// Upper bound on the error of in_frame() by rounding of world positions, metres.
btScalar rounding_bound(const Obstacles::Record& record, const AxisBox& box) {
  if (box.is_empty()) return 0;
  constexpr btScalar roundings = 32;
  btVector3 farthest = record.start.getOrigin().absolute();
  for (const btVector3& corner : {box.lower, box.upper, record.end.getOrigin()})
    farthest.setMax(corner.absolute());
  return roundings * SIMD_EPSILON * farthest[farthest.maxAxis()];
}

// Returns the broad phase of the soft bodies' world, or null if no body has one. Does not depend on
// whether a soft body collides with rigid ones: if one does later, their motion must be known then.
btBroadphaseInterface* broadphase_of(const Obstacles::SoftBodies& bodies) {
  for (int i = 0; i < bodies.size(); ++i) {
    const btSoftBodyWorldInfo* const info = bodies[i]->m_worldInfo;
    if (info && info->m_broadphase) return info->m_broadphase;
  }
  return nullptr;
}

void mix(std::uint64_t value, std::uint64_t& hash) {
  hash = (hash ^ value) * 0x9e3779b97f4a7c15u + 1;
}

void mix(btScalar x, std::uint64_t& hash) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof x);
  mix(bits, hash);
}

void mix(const btVector3& v, std::uint64_t& hash) {
  for (int k = 0; k < 3; ++k) mix(v[k], hash);
}

// Hash of what makes a surface and does not show in the bounds and the scaling of the shape, after
// `hash`. Bullet's own revision of a compound counts neither a child that moves nor what happens in
// a compound inside of it. Where children are is not part of it.
std::uint64_t hash_of_surface(const btCollisionShape& shape, std::uint64_t hash) {
  mix(static_cast<std::uint64_t>(shape.getShapeType()), hash);
  if (shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE) {
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    for (int i = 0; i < hull.getNumPoints(); ++i) mix(hull.getUnscaledPoints()[i], hash);
  }
  if (!shape.isCompound()) {
    mix(shape.getMargin(), hash);
    return hash;
  }
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    const btCollisionShape& child = *compound.getChildShape(i);
    mix(static_cast<std::uint64_t>(std::hash<const void*>()(&child)), hash);
    mix(child.getLocalScaling(), hash);
    if (!child.isCompound()) {
      btVector3 lower, upper;
      child.getAabb(btTransform::getIdentity(), lower, upper);
      mix(lower, hash);
      mix(upper, hash);
    }
    hash = hash_of_surface(child, hash);
  }
  return hash;
}

// Hash of where the children of a compound are, after `hash`.
std::uint64_t hash_of_child_poses(const btCollisionShape& shape, std::uint64_t hash) {
  if (!shape.isCompound()) return hash;
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    const btTransform& pose = compound.getChildTransform(i);
    mix(pose.getOrigin(), hash);
    for (int k = 0; k < 3; ++k) mix(pose.getBasis()[k], hash);
    hash = hash_of_child_poses(*compound.getChildShape(i), hash);
  }
  return hash;
}

Obstacles::Record record_of(const RigidPose& pose) {
  Obstacles::Record record;
  static_cast<RigidPose&>(record) = pose;
  btCollisionObject& object = *pose.object;
  record.shape = object.getCollisionShape();
  record.scaling = record.shape->getLocalScaling();
  record.surface = hash_of_surface(*record.shape, 0);
  record.child_poses = hash_of_child_poses(*record.shape, 0);
  btVector3 lower, upper;
  record.shape->getAabb(btTransform::getIdentity(), lower, upper);
  record.box = {lower.x(), lower.y(), lower.z(), upper.x(), upper.y(), upper.z()};
  record.group = object.getBroadphaseHandle()->m_collisionFilterGroup;
  record.mask = object.getBroadphaseHandle()->m_collisionFilterMask;
  record.ignored = hash_of_ignored(object);
  record.dynamic = is_movable(object);
  record.responds = object.hasContactResponse();
  return record;
}

// Whether nothing but the places of a compound's children has changed.
bool is_same(const Obstacles::Record& a, const Obstacles::Record& b) {
  return a.object == b.object && a.unique_id == b.unique_id && a.shape == b.shape &&
         a.scaling == b.scaling && a.surface == b.surface &&
         (a.box == b.box || a.child_poses != b.child_poses) && a.group == b.group &&
         a.mask == b.mask && a.ignored == b.ignored && a.dynamic == b.dynamic &&
         a.responds == b.responds;
}

}  // namespace

bool Obstacles::is_fully_known(const btCollisionObject& object) {
  return is_rigid(object) && object.hasContactResponse() &&
         has_triangles(*object.getCollisionShape());
}

void Obstacles::invalidate() { *this = Obstacles(jump_speed_); }

void Obstacles::begin_step(const SoftBodies& bodies) { poses_.begin_step(broadphase_of(bodies)); }

void Obstacles::read_poses(const SoftBodies& bodies, double dt, WarningLog& warnings) {
  dt_ = static_cast<btScalar>(dt);
  ++step_;
  poses_.set_carriers(find_carriers(bodies));
  poses_.end_step(broadphase_of(bodies), dt_, warnings);
}

Obstacles::Boxes Obstacles::moving_bounds() const {
  Boxes boxes;
  for (const RigidPose* const followed : poses_.followed()) {
    const RigidPose& pose = *followed;
    const bool moves = !pose.at_rest && !(pose.start == pose.end);
    if ((moves || pose.jumped || poses_.is_added(pose)) && pose.finite &&
        pose.object->hasContactResponse())
      boxes.push_back(bounds(pose));
  }
  return boxes;
}

bool Obstacles::update(const SoftBodies& bodies, const Boxes& swept, double depth,
                       WarningLog& warnings) {
  anchor_objects_ = find_anchor_objects(bodies);
  depth_ = depth;
  return update_regions(swept, warnings);
}

bool Obstacles::has_read(const Boxes& swept) const {
  return regions_.contain(swept) &&
         std::all_of(records_.begin(), records_.end(), [&](const Record& record) {
           return !is_cut_to_region(*record.shape) ||
                  record.region.contains(needed_region(record, swept));
         });
}

bool Obstacles::update_regions(const Boxes& swept, WarningLog& warnings) {
  const bool any_too_large = regions_.update(swept);
  poses_.follow(regions_.boxes(), warnings);
  next_records_.clear();
  for (const RigidPose* const followed : poses_.followed()) {
    const RigidPose& pose = *followed;
    const bool has_anchored_nodes =
        std::binary_search(anchor_objects_.begin(), anchor_objects_.end(), pose.object) &&
        is_movable(*pose.object);
    const bool is_near =
        overlaps_any(regions_.boxes(), bounds(pose)) && pose.object->hasContactResponse();
    if (!(has_anchored_nodes || is_near) || !pose.finite) continue;
    next_records_.push_back(record_of(pose));
    next_records_.back().has_anchored_nodes = has_anchored_nodes;
  }
  const bool same_depth = read_depth_ == depth_;
  bool is_unchanged = same_depth && next_records_.size() == records_.size();
  auto old = records_.begin();
  for (Record& record : next_records_) {
    while (old != records_.end() && old->unique_id < record.unique_id) ++old;
    record.step = step_;
    const bool was_near = old != records_.end() && old->unique_id == record.unique_id;
    is_unchanged = is_unchanged && was_near && keeps_triangles(record, *old) && same_depth;
    if (!was_near) continue;
    const bool is_in_same_step = old->step == step_;
    const bool has_moved = record.child_poses != old->child_poses;
    record.is_changed = !is_same(record, *old) || (old->is_changed && is_in_same_step);
    if (is_same(record, *old) && has_moved && old->triangles)
      record.last_leaves =
          std::make_shared<const std::vector<Triangles::Leaf>>(old->triangles->leaves);
    else if (is_same(record, *old) && is_in_same_step)
      record.last_leaves = old->last_leaves;
    const bool is_read_again = any_too_large && is_cut_to_region(*record.shape);
    is_unchanged = is_unchanged && !is_read_again;
    if (!same_depth || !keeps_triangles(record, *old) || is_read_again) continue;
    record.region = old->region;
    record.triangles = old->triangles;
    record.last_vertices = old->last_vertices;
    record.first_vertex = old->first_vertex;
    record.vertex_count = old->vertex_count;
  }
  records_.swap(next_records_);
  next_records_.clear();
  return !(is_unchanged && has_read(swept));
}

void Obstacles::hold_at_start(const btCollisionObject& object) {
  poses_.hold_at_start(object);
  for (Record& record : records_) {
    if (record.object != &object || !record.last_vertices) continue;
    Triangles held = *record.triangles;
    held.vertices = *record.last_vertices;
    held.leaves = *record.last_leaves;
    record.triangles = std::make_shared<const Triangles>(std::move(held));
    record.last_leaves = nullptr;
    record.last_vertices = nullptr;
    ++record.child_poses;  // no longer those of the triangles
  }
}

// Whether the triangles of an obstacle are still those of its last record. Its children may have
// moved before that record, in this step.
bool Obstacles::keeps_triangles(const Record& record, const Record& last) const {
  return is_same(record, last) && record.child_poses == last.child_poses &&
         (!last.last_leaves || last.step == step_) &&
         record.has_anchored_nodes == last.has_anchored_nodes;
}

AxisBox Obstacles::needed_region(const Record& record, Span<const AxisBox> boxes) const {
  const int type = record.shape->getShapeType();
  const AxisBox all{btVector3(record.box[0], record.box[1], record.box[2]),
                    btVector3(record.box[3], record.box[4], record.box[5])};
  const btVector3 size = all.upper - all.lower;
  const bool is_bounded = size[size.maxAxis()] < BT_LARGE_FLOAT;  // without a plane in a compound
  const bool may_read_all =
      is_bounded && type != STATIC_PLANE_PROXYTYPE && type != TERRAIN_SHAPE_PROXYTYPE;
  if (reads_whole_mesh(record) && may_read_all) return all;
  return in_frame(record, bounds_of_overlapping(boxes, bounds(record)));
}

void Obstacles::read_triangles(const Boxes& starts, WarningLog& warnings) {
  read_depth_ = depth_;
  local_positions_.clear();
  faces_.clear();
  for (Record& record : records_) {
    if (!record.triangles || is_cut_to_region(*record.shape))
      read_triangles(record, enlarged(bounds_of_overlapping(starts, bounds(record))), warnings);
    append_triangles(record);
  }
}

void Obstacles::read_triangles(Record& record, const AxisBox& near, WarningLog& warnings) const {
  Triangles triangles;
  // Reads a little more of a mesh than the region, so that a moving mesh keeps its triangles for
  // some steps. The addition is at least the rounding error of world positions moved to the mesh's
  // frame.
  record.region = needed_region(record, regions_.boxes());
  btVector3 spare = btScalar(0.1) * (record.region.upper - record.region.lower);
  const btScalar bound =
      rounding_bound(record, bounds_of_overlapping(regions_.boxes(), bounds(record)));
  spare.setMax(btVector3(bound, bound, bound));
  record.region = record.region.expanded(spare);
  if (record.responds && !tessellate(*record.shape, btTransform::getIdentity(), record.region,
                                     in_frame(record, near), depth_, triangles)) {
    warnings.warn_once("shape " + std::to_string(record.unique_id),
                       std::string("a rigid body's shape (") + record.shape->getName() +
                           ") has a part without triangles; only Bullet handles that part");
  }
  // If all triangles were points or lines, only their corners are left.
  if (triangles.faces.empty()) triangles.vertices.clear();
  record.triangles = std::make_shared<const Triangles>(std::move(triangles));
  sweep_children(record);
}

void Obstacles::sweep_children(Record& record) const {
  if (!record.last_leaves) return;
  const std::vector<Triangles::Leaf>& from = *record.last_leaves;
  const std::vector<Triangles::Leaf>& to = record.triangles->leaves;
  std::vector<btVector3> last = record.triangles->vertices;
  bool are_swept = from.size() == to.size();
  for (std::size_t i = 0; are_swept && i < to.size(); ++i) {
    if (from[i].pose == to[i].pose) continue;
    const btTransform back = from[i].pose * to[i].pose.inverse();
    const std::size_t next =
        i + 1 < to.size() ? static_cast<std::size_t>(to[i + 1].first_vertex) : last.size();
    const std::size_t end = std::min(next, last.size());  // without faces no vertices are left
    for (auto v = static_cast<std::size_t>(to[i].first_vertex); v < end; ++v) {
      last[v] = back * record.triangles->vertices[v];
      are_swept = are_swept && last[v].distance(record.triangles->vertices[v]) <= jump_speed_ * dt_;
    }
  }
  if (are_swept) {
    record.last_vertices = std::make_shared<const std::vector<btVector3>>(std::move(last));
    return;
  }
  record.last_leaves = nullptr;
  record.is_changed = true;
}

void Obstacles::append_triangles(Record& record) {
  record.first_vertex = vertex_count();
  record.vertex_count = static_cast<std::int32_t>(record.triangles->vertices.size());
  for (Face face : record.triangles->faces) {
    for (std::int32_t& corner : face) corner += record.first_vertex;
    faces_.push_back(face);
  }
  local_positions_.insert(local_positions_.end(), record.triangles->vertices.begin(),
                          record.triangles->vertices.end());
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
