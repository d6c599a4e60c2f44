#include "scene/obstacles.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "scene/collision_filters.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// What btDeformableBodySolver moves nodes with.
std::vector<const btCollisionObject*> find_carriers(const Obstacles::SoftBodies& bodies) {
  std::vector<const btCollisionObject*> found;
  for (int i = 0; i < bodies.size(); ++i) {
    const auto& anchors = bodies[i]->m_deformableAnchors;
    for (int k = 0; k < anchors.size(); ++k) found.push_back(anchors[k].m_cti.m_colObj);
  }
  std::sort(found.begin(), found.end());
  return found;
}

AxisBox bounds(const RigidPose& pose) {
  const btCollisionShape& shape = *pose.object->getCollisionShape();
  AxisBox box;
  shape.getAabb(pose.end, box.lower, box.upper);
  if (pose.start == pose.end) return box;
  AxisBox at_start;
  shape.getAabb(pose.start, at_start.lower, at_start.upper);
  box.add(at_start);
  return box;
}

// What of `box` a body may meet during the step, in the body's frame. Its points move straight from
// start to end. One that meets the box began no farther from it than it moves, and between the two
// the body is smaller than itself, by the cosine of half its turn.
AxisBox in_frame(const Obstacles::Record& record, const AxisBox& box) {
  if (box.is_empty()) return box;
  const AxisBox local = box.placed(record.start.inverse());
  const btMatrix3x3 turned = record.end.getBasis() - record.start.getBasis();
  // Twice the sine of half the turn.
  const btScalar chord =
      btSqrt((turned[0].length2() + turned[1].length2() + turned[2].length2()) / 2);
  const btScalar shrunk = btMax(btSqrt(btMax(1 - chord * chord / 4, btScalar(0))), btScalar(0.01));
  const btScalar translation = record.start.getOrigin().distance(record.end.getOrigin());
  btVector3 farthest = local.lower.absolute();
  farthest.setMax(local.upper.absolute());
  const btScalar moved = translation + chord * (farthest.length() + translation) / shrunk;
  return local.grown(btVector3(moved, moved, moved));
}

// No less than in_frame() may be off by the rounding of places in the world. Metres.
btScalar rounded_off(const Obstacles::Record& record, const AxisBox& box) {
  if (box.is_empty()) return 0;
  constexpr btScalar roundings = 32;
  btVector3 farthest = record.start.getOrigin().absolute();
  for (const btVector3& corner : {box.lower, box.upper, record.end.getOrigin()})
    farthest.setMax(corner.absolute());
  return roundings * SIMD_EPSILON * farthest[farthest.maxAxis()];
}

AxisBox with_room(const AxisBox& box) {
  if (box.is_empty()) return box;
  const btVector3 size = box.upper - box.lower;
  const btScalar spare = btScalar(0.25) * size[size.maxAxis()];
  return box.grown(btScalar(0.25) * size + btVector3(spare, spare, spare));
}

// That of bodies that meet rigid ones or are carried by them; null where there are none.
// Also where no soft body meets rigid ones: one that comes to is to meet them on their way.
btBroadphaseInterface* broadphase_of(const Obstacles::SoftBodies& bodies) {
  for (int i = 0; i < bodies.size(); ++i) {
    const btSoftBodyWorldInfo* const info = bodies[i]->m_worldInfo;
    if (info && info->m_broadphase) return info->m_broadphase;
  }
  return nullptr;
}

Obstacles::Record record_of(const RigidPose& pose) {
  Obstacles::Record record;
  static_cast<RigidPose&>(record) = pose;
  btCollisionObject& object = *pose.object;
  record.shape = object.getCollisionShape();
  record.scaling = record.shape->getLocalScaling();
  record.revision = record.shape->isCompound()
                        ? static_cast<const btCompoundShape*>(record.shape)->getUpdateRevision()
                        : 0;
  btVector3 lower, upper;
  record.shape->getAabb(btTransform::getIdentity(), lower, upper);
  record.box = {lower.x(), lower.y(), lower.z(), upper.x(), upper.y(), upper.z()};
  record.group = object.getBroadphaseHandle()->m_collisionFilterGroup;
  record.mask = object.getBroadphaseHandle()->m_collisionFilterMask;
  record.ignored = hash_of_ignored(object);
  record.dynamic = is_dynamic(object);
  record.responds = object.hasContactResponse();
  return record;
}

bool is_same(const Obstacles::Record& a, const Obstacles::Record& b) {
  return a.object == b.object && a.unique_id == b.unique_id && a.shape == b.shape &&
         a.scaling == b.scaling && a.revision == b.revision && a.box == b.box &&
         a.group == b.group && a.mask == b.mask && a.ignored == b.ignored &&
         a.dynamic == b.dynamic && a.responds == b.responds && a.has_anchored_nodes == b.has_anchored_nodes;
}

}  // namespace

bool Obstacles::meets_obstacles(const btSoftBody& body) {
  using Flag = btSoftBody::fCollision;
  return (body.m_cfg.collisions & (Flag::SDF_RS | Flag::SDF_RD | Flag::SDF_RDF | Flag::SDF_RDN)) &&
         !(body.m_cfg.collisions & Flag::CL_RS);
}

bool Obstacles::is_whole(const btCollisionObject& object) {
  return is_rigid(object) && object.hasContactResponse() &&
         has_triangles(*object.getCollisionShape()) &&
         object.getInternalType() != btCollisionObject::CO_FEATHERSTONE_LINK;
}

void Obstacles::clear() { *this = Obstacles(); }

void Obstacles::begin_step(const SoftBodies& bodies) { poses_.begin_step(broadphase_of(bodies)); }

bool Obstacles::update(const SoftBodies& bodies, const AxisBox& swept, double depth,
                       WarningLog& warnings) {
  poses_.end_step(broadphase_of(bodies), warnings);
  carriers_ = find_carriers(bodies);
  depth_ = depth;
  return update_region(swept);
}

bool Obstacles::has_read(const AxisBox& swept) const {
  if (swept.is_empty()) return true;
  return region_.contains(swept) &&
         std::all_of(records_.begin(), records_.end(), [&](const Record& record) {
           return !is_cut_to_region(*record.shape) ||
                  record.region.contains(in_frame(record, swept));
         });
}

bool Obstacles::update_region(const AxisBox& swept) {
  const bool left_region = !swept.is_empty() && !region_.contains(swept);
  if (left_region) region_ = with_room(swept);
  std::vector<Record> near;
  for (const RigidPose& pose : poses_.all()) {
    const bool has_anchored_nodes = is_dynamic(*pose.object) &&
                         std::binary_search(carriers_.begin(), carriers_.end(), pose.object);
    const bool is_near =
        !swept.is_empty() && pose.object->hasContactResponse() && bounds(pose).overlaps(region_);
    if (!(has_anchored_nodes || is_near) || !pose.finite) continue;
    near.push_back(record_of(pose));
    near.back().has_anchored_nodes = has_anchored_nodes;
  }
  const bool same_depth = read_depth_ == depth_;
  bool same = same_depth && near.size() == records_.size();
  auto old = records_.begin();
  for (Record& record : near) {
    while (old != records_.end() && old->unique_id < record.unique_id) ++old;
    const bool is_known = same_depth && old != records_.end() && is_same(record, *old);
    same = same && is_known;
    if (!is_known) continue;
    record.region = old->region;
    record.triangles = old->triangles;
    record.first_vertex = old->first_vertex;
    record.vertex_count = old->vertex_count;
  }
  records_ = std::move(near);
  return !(same && has_read(swept));
}

void Obstacles::read_triangles(const AxisBox& starts, WarningLog& warnings) {
  read_depth_ = depth_;
  local_.clear();
  faces_.clear();
  const AxisBox around = with_room(starts);
  for (Record& record : records_) {
    if (!record.triangles || is_cut_to_region(*record.shape))
      read_triangles(record, around, warnings);
    append_triangles(record);
  }
}

void Obstacles::read_triangles(Record& record, const AxisBox& near, WarningLog& warnings) const {
  Triangles triangles;
  // Meshes are asked for a little more than the region, so that one that moves keeps its triangles
  // for some steps; and no less than is rounded off of places in the world on the way to its frame.
  record.region = in_frame(record, region_);
  btVector3 spare = btScalar(0.1) * (record.region.upper - record.region.lower);
  const btScalar rounded = rounded_off(record, region_);
  spare.setMax(btVector3(rounded, rounded, rounded));
  record.region = record.region.grown(spare);
  if (record.responds && !tessellate(*record.shape, btTransform::getIdentity(), record.region,
                                     in_frame(record, near), depth_, triangles)) {
    warnings.warn_once("shape " + std::to_string(record.unique_id),
                std::string("a rigid body's shape has a part without triangles (") +
                    record.shape->getName() + "): that part stays with Bullet alone");
  }
  // Of triangles that are points or lines nothing is left but corners.
  if (triangles.faces.empty()) triangles.vertices.clear();
  record.triangles = std::make_shared<const Triangles>(std::move(triangles));
}

void Obstacles::append_triangles(Record& record) {
  record.first_vertex = vertex_count();
  record.vertex_count = static_cast<std::int32_t>(record.triangles->vertices.size());
  for (Face face : record.triangles->faces) {
    for (std::int32_t& corner : face) corner += record.first_vertex;
    faces_.push_back(face);
  }
  local_.insert(local_.end(), record.triangles->vertices.begin(), record.triangles->vertices.end());
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
