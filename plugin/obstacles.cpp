#include "obstacles.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "pair_rules.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

bool is_rigid(const btCollisionObject& object) {
  constexpr int rigid = btCollisionObject::CO_COLLISION_OBJECT | btCollisionObject::CO_RIGID_BODY |
                        btCollisionObject::CO_FEATHERSTONE_LINK;
  return (object.getInternalType() & rigid) != 0;
}

class Collector : public btBroadphaseAabbCallback {
 public:
  bool process(const btBroadphaseProxy* proxy) override {
    auto* object = static_cast<btCollisionObject*>(proxy->m_clientObject);
    if (is_rigid(*object)) objects.push_back(object);
    return true;
  }
  std::vector<btCollisionObject*> objects;
};

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

bool is_finite(const btTransform& t) {
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(t.getOrigin()[i])) return false;
    for (int k = 0; k < 3; ++k) {
      if (!std::isfinite(t.getBasis()[i][k])) return false;
    }
  }
  return true;
}

bool has_finite_velocity(const btCollisionObject& object) {
  const btRigidBody* body = btRigidBody::upcast(&object);
  return !body || (std::isfinite(body->getLinearVelocity().length2()) &&
                   std::isfinite(body->getAngularVelocity().length2()));
}

AxisBox bounds(const Obstacles::Record& record) {
  AxisBox at_start, at_end;
  record.shape->getAabb(record.start, at_start.lower, at_start.upper);
  record.shape->getAabb(record.end, at_end.lower, at_end.upper);
  at_start.add(at_end);
  return at_start;
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
  const btScalar shift = record.start.getOrigin().distance(record.end.getOrigin());
  btVector3 farthest = local.lower.absolute();
  farthest.setMax(local.upper.absolute());
  const btScalar moved = shift + chord * (farthest.length() + shift) / shrunk;
  return local.grown(btVector3(moved, moved, moved));
}

// Metres that a point of the body moves at most, about.
btScalar way(const Obstacles::Record& record, const btTransform& from, const btTransform& to) {
  btVector3 centre;
  btScalar radius;
  record.shape->getBoundingSphere(centre, radius);
  const btMatrix3x3 turned = to.getBasis() - from.getBasis();
  const btScalar turn = turned[0].length() + turned[1].length() + turned[2].length();
  return from.getOrigin().distance(to.getOrigin()) + turn * (centre.length() + radius);
}

// Where a body is at the end of the step that Bullet has at `now`: there, or on the way to it where
// it was left behind.
btTransform follow(const Obstacles::Record& record, const btTransform& now) {
  constexpr btScalar least_part = btScalar(0.1);
  if (record.start == record.seen) return now;
  const btScalar left = way(record, record.start, now), moved = way(record, record.seen, now);
  if (!(left > 2 * moved)) return now;
  const btScalar part = btMax(2 * moved / left, least_part);
  return btTransform(record.start.getRotation().slerp(now.getRotation(), part),
                     record.start.getOrigin().lerp(now.getOrigin(), part));
}

bool is_same(const Obstacles::Record& a, const Obstacles::Record& b) {
  return a.object == b.object && a.unique_id == b.unique_id && a.shape == b.shape &&
         a.scaling == b.scaling && a.revision == b.revision && a.box == b.box &&
         a.group == b.group && a.mask == b.mask && a.ignored == b.ignored &&
         a.dynamic == b.dynamic && a.responds == b.responds && a.carries == b.carries;
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

void Obstacles::find(const SoftBodies& bodies) {
  Collector collector;
  for (int i = 0; i < bodies.size(); ++i) {
    btBroadphaseInterface* broadphase =
        bodies[i]->m_worldInfo ? bodies[i]->m_worldInfo->m_broadphase : nullptr;
    const bool is_concerned =
        meets_obstacles(*bodies[i]) || bodies[i]->m_deformableAnchors.size() > 0;
    if (!broadphase || !is_concerned) continue;
    const btScalar far = BT_LARGE_FLOAT;
    broadphase->aabbTest(btVector3(-far, -far, -far), btVector3(far, far, far), collector);
    break;
  }
  const std::vector<const btCollisionObject*> carriers = find_carriers(bodies);
  std::vector<Record> found;
  for (btCollisionObject* object : collector.objects) {
    Record record;
    record.object = object;
    record.responds = object->hasContactResponse();
    record.dynamic = btRigidBody::upcast(object) && !object->isStaticOrKinematicObject();
    record.carries = record.dynamic && std::binary_search(carriers.begin(), carriers.end(), object);
    if (!record.responds && !record.carries) continue;
    record.unique_id = object->getBroadphaseHandle()->m_uniqueId;
    record.shape = object->getCollisionShape();
    record.scaling = record.shape->getLocalScaling();
    record.revision = record.shape->isCompound()
                          ? static_cast<const btCompoundShape*>(record.shape)->getUpdateRevision()
                          : 0;
    btVector3 lower, upper;
    record.shape->getAabb(btTransform::getIdentity(), lower, upper);
    record.box = {lower.x(), lower.y(), lower.z(), upper.x(), upper.y(), upper.z()};
    record.group = object->getBroadphaseHandle()->m_collisionFilterGroup;
    record.mask = object->getBroadphaseHandle()->m_collisionFilterMask;
    record.ignored = hash_of_ignored(*object);
    record.start = record.end = record.seen = object->getWorldTransform();
    found.push_back(record);
  }
  // The broad phase has no order of its own.
  const auto before = [](const Record& a, const Record& b) { return a.unique_id < b.unique_id; };
  std::sort(found.begin(), found.end(), before);
  auto old = found_.begin();
  for (Record& record : found) {
    while (old != found_.end() && before(*old, record)) ++old;
    if (old == found_.end() || before(record, *old) || old->object != record.object) continue;
    // What is driven is swept from where the last step left it.
    record.start = old->start;
    record.end = old->end;
    record.seen = old->seen;
  }
  found_ = std::move(found);
}

void Obstacles::begin_step(const SoftBodies& bodies) {
  find(bodies);
  for (Record& record : found_) {
    record.start = record.dynamic ? record.object->getWorldTransform() : record.end;
  }
}

bool Obstacles::update(const SoftBodies& bodies, const AxisBox& swept, double depth,
                       Journal& journal) {
  find(bodies);
  if (depth != depth_) records_.clear();  // all is read anew
  depth_ = depth;
  for (Record& record : found_) {
    const btTransform& now = record.object->getWorldTransform();
    record.end = record.dynamic ? now : follow(record, now);
    record.seen = now;
    record.finite = is_finite(record.end) && has_finite_velocity(*record.object);
    if (record.finite && is_finite(record.start)) continue;
    record.start = record.end;
    journal.say(
        "obstacle " + std::to_string(record.unique_id),
        "rigid body " + std::to_string(record.unique_id) +
            " (by broad phase proxy): its transform or velocity is not finite; it is left out");
  }
  return read(swept, journal);
}

bool Obstacles::has_read(const AxisBox& swept) const {
  if (swept.is_empty()) return true;
  return region_.contains(swept) &&
         std::all_of(records_.begin(), records_.end(), [&](const Record& record) {
           return !is_cut_to_region(*record.shape) ||
                  record.region.contains(in_frame(record, swept));
         });
}

bool Obstacles::read(const AxisBox& swept, Journal& journal) {
  const bool left_region = !swept.is_empty() && !region_.contains(swept);
  if (left_region) {
    const btVector3 size = swept.upper - swept.lower;
    const btScalar spare = btScalar(0.25) * size[size.maxAxis()];
    region_ = swept.grown(btScalar(0.25) * size + btVector3(spare, spare, spare));
  }
  std::vector<Record> near;
  for (const Record& record : found_) {
    const bool is_near = !swept.is_empty() && bounds(record).overlaps(region_);
    if (record.finite && (record.carries || is_near)) near.push_back(record);
  }
  bool same = near.size() == records_.size();
  for (std::size_t i = 0; same && i < near.size(); ++i) {
    near[i].region = records_[i].region;
    near[i].first_vertex = records_[i].first_vertex;
    near[i].vertex_count = records_[i].vertex_count;
    same = is_same(near[i], records_[i]);
  }
  records_ = std::move(near);
  if (same && has_read(swept)) return false;
  read_triangles(journal);
  return true;
}

void Obstacles::leave_behind(const btCollisionObject& object) {
  for (Record& record : found_) {
    if (record.object == &object) record.end = record.start;
  }
}

void Obstacles::read_triangles(Journal& journal) {
  local_.clear();
  faces_.clear();
  for (Record& record : records_) {
    Triangles triangles;
    // Meshes are asked for a little more than the region, so that one that moves keeps its
    // triangles for some steps.
    record.region = in_frame(record, region_);
    const btVector3 spare = btScalar(0.1) * (record.region.upper - record.region.lower);
    record.region = record.region.grown(spare);
    if (record.responds &&
        !tessellate(*record.shape, btTransform::getIdentity(), record.region, depth_, triangles)) {
      journal.say("shape " + std::to_string(record.unique_id),
                  std::string("a rigid body's shape has a part without triangles (") +
                      record.shape->getName() + "): that part stays with Bullet alone");
    }
    // Of triangles that are points or lines nothing is left but corners.
    if (triangles.faces.empty()) triangles.vertices.clear();
    record.first_vertex = vertex_count();
    record.vertex_count = static_cast<std::int32_t>(triangles.vertices.size());
    for (Face face : triangles.faces) {
      for (std::int32_t& corner : face) corner += record.first_vertex;
      faces_.push_back(face);
    }
    local_.insert(local_.end(), triangles.vertices.begin(), triangles.vertices.end());
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
