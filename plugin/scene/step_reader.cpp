#include "scene/step_reader.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>

#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// A body this fast has exploded: rounding leaves nothing of its surface, and what it sweeps would
// keep exact arithmetic busy for minutes. m/s.
constexpr double speed_of_light = 299792458;

// Says which bodies are new where memory is reused.
int proxy_id(const SoftScene::BodyRecord& record) {
  const btBroadphaseProxy* proxy = record.body->getBroadphaseHandle();
  return proxy ? proxy->m_uniqueId : -1;
}

// Without its place in the motion. Bodies that nothing moves have no mobility.
RigidMotion rigid_motion(const btCollisionObject& object) {
  RigidMotion motion;
  motion.velocity = motion.angular_velocity = motion.inverse_mass = Eigen::Vector3d::Zero();
  motion.inverse_inertia = Eigen::Matrix3d::Zero();
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (!body) return motion;
  motion.velocity = to_eigen(body->getLinearVelocity());
  motion.angular_velocity = to_eigen(body->getAngularVelocity());
  if (body->isStaticOrKinematicObject()) return motion;
  motion.inverse_mass = static_cast<double>(body->getInvMass()) * to_eigen(body->getLinearFactor());
  const Eigen::Matrix3d free(to_eigen(body->getAngularFactor()).asDiagonal());
  motion.inverse_inertia = free * to_eigen(body->getInvInertiaTensorWorld()) * free;
  return motion;
}

}  // namespace

void StepReader::begin_step(const Bodies& bodies) {
  for (int i = 0; i < bodies.size(); ++i) {
    // Bullet clears the mark of active bodies only; of the others it is part of the scene's stamp.
    if (bodies[i]->m_bUpdateRtCst && bodies[i]->isActive()) scene_.invalidate();
  }
  if (options_.collide_rigid) obstacles_.begin_step(bodies);
}

StepReader::Changes StepReader::read(const Bodies& bodies, double dt, const Fill& fill) {
  scene_.reinclude(bodies);
  Changes changes;
  do {
    changes.topology = scene_.update(bodies, warnings_) || changes.topology;
  } while (!gather_soft(dt, fill));
  changes.start = changes.topology;
  changes.start = sweep_driven_nodes() || changes.start;
  if (options_.collide_rigid &&
      obstacles_.update(bodies, near_obstacles_, depth_in_obstacles(), warnings_)) {
    obstacles_.read_triangles(starts_near_obstacles(), warnings_);
    changes.topology = true;
  }
  changes.topology = topology_.update(scene_, obstacles_, changes.topology);
  gather_obstacles();
  read_resolution();
  changes.start = changes.start || are_others_near();
  return changes;
}

// What is left of the gap to what is round, then, is half of it or more.
double StepReader::depth_in_obstacles() const {
  double least = std::numeric_limits<double>::infinity();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    if (Obstacles::meets_obstacles(*record.body))
      least = std::min(least, static_cast<double>(record.margin));
  }
  return 0.5 * (options_.thickness >= 0 ? options_.thickness : least);
}

bool StepReader::are_others_near() const {
  const auto before = [](const LastObstacle& last, int id) { return last.unique_id < id; };
  return std::any_of(obstacles_.records().begin(), obstacles_.records().end(),
                     [&](const Obstacles::Record& record) {
                       if (record.vertex_count == 0) return false;
                       const auto last =
                           std::lower_bound(last_obstacles_.begin(), last_obstacles_.end(),
                                            record.unique_id, before);
                       if (last == last_obstacles_.end() || last->unique_id != record.unique_id)
                         return true;
                       return record.dynamic && !(record.start == last->end);
                     });
}

bool StepReader::sweep_driven_nodes() {
  bool displaced = false;
  auto next = last_ends_.begin();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    const auto is_same = [&record, id = proxy_id(record)](const LastEnd& end) {
      return end.body == record.body && end.proxy_id == id;
    };
    // As a rule in the same order.
    auto last = next;
    if (last == last_ends_.end() || !is_same(*last))
      last = std::find_if(last_ends_.begin(), last_ends_.end(), is_same);
    if (last != last_ends_.end()) next = last + 1;
    const std::size_t count = 3 * static_cast<std::size_t>(record.vertex_count);
    if (last == last_ends_.end() || last->positions.size() != count) continue;
    btScalar* const start = &motion_.start[3 * static_cast<std::size_t>(record.first_vertex)];
    if (std::equal(start, start + count, last->positions.begin())) continue;
    bool free_moved = false;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t v = static_cast<std::size_t>(record.first_vertex) + i / 3;
      free_moved = free_moved || (motion_.inverse_mass[v] > 0 && start[i] != last->positions[i]);
    }
    displaced = displaced || free_moved;
    if (free_moved) continue;
    AxisBox came_from = AxisBox::empty();
    std::copy(last->positions.begin(), last->positions.end(), start);
    for (std::size_t i = 0; i < count; i += 3)
      came_from.add(btVector3(start[i], start[i + 1], start[i + 2]));
    swept_.add(came_from);
    bounds_[index_of(record)].add(came_from);
    if (Obstacles::meets_obstacles(*record.body))
      near_obstacles_.add(came_from.grown(btVector3(record.margin, record.margin, record.margin)));
  }
  return displaced;
}

void StepReader::remember_ends() {
  last_ends_.resize(scene_.bodies().size());
  for (std::size_t i = 0; i < last_ends_.size(); ++i) {
    const SoftScene::BodyRecord& record = scene_.bodies()[i];
    const auto first = motion_.end.begin() + 3 * static_cast<std::ptrdiff_t>(record.first_vertex);
    last_ends_[i].body = record.body;
    last_ends_[i].proxy_id = proxy_id(record);
    last_ends_[i].positions.assign(first,
                                   first + 3 * static_cast<std::ptrdiff_t>(record.vertex_count));
  }
  last_obstacles_.clear();
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    if (body.soft) continue;
    const auto index = static_cast<std::int32_t>(&body - topology_.bodies().data());
    last_obstacles_.push_back(
        {obstacles_.records()[body.obstacle].unique_id, motion_.rigid_of(index).end});
  }
  std::sort(last_obstacles_.begin(), last_obstacles_.end(),
            [](const LastObstacle& a, const LastObstacle& b) { return a.unique_id < b.unique_id; });
}

void StepReader::read_resolution() {
  constexpr double roundings = 16;
  constexpr double least_speed = 4e-4;  // m/s: the response leaves gaps open by a part of it
  if (swept_.is_empty()) return;
  btScalar farthest = 0;
  for (int k = 0; k < 3; ++k)
    farthest = std::max({farthest, std::abs(swept_.lower[k]), std::abs(swept_.upper[k])});
  const double rounding =
      static_cast<double>(farthest) * static_cast<double>(std::numeric_limits<btScalar>::epsilon());
  const double resolution = roundings * rounding + least_speed * motion_.dt;
  if (resolution > resolution_ || 4 * resolution < resolution_) resolution_ = 2 * resolution;
}

// One way through Bullet's nodes. False where the scene is to be read anew: something was refused,
// or other nodes are pinned.
bool StepReader::gather_soft(double dt, const Fill& fill) {
  const std::size_t count = static_cast<std::size_t>(scene_.vertex_count());
  motion_.dt = dt;
  motion_.start.resize(3 * count);
  motion_.end.resize(3 * count);
  motion_.velocity.resize(count);
  motion_.rate.resize(count);
  motion_.inverse_mass.resize(count);
  swept_ = near_obstacles_ = AxisBox::empty();
  bounds_.assign(scene_.bodies().size(), AxisBox::empty());
  bool pinned_as_read = true;
  std::vector<std::int32_t> excluded;
  std::mutex mutex;
  scene_.for_each_range(threads_, [&](const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last) {
    // Blocks as small as the processor's nearest cache are read, and looked at while they are
    // there.
    constexpr std::int32_t block = 128;
    Found found;
    for (; first < last; first += block)
      gather_block(record, first, std::min(last, first + block), fill, found);
    const std::lock_guard<std::mutex> lock(mutex);
    swept_.add(found.swept);
    bounds_[index_of(record)].add(found.swept);
    if (Obstacles::meets_obstacles(*record.body)) near_obstacles_.add(found.swept);
    pinned_as_read = pinned_as_read && found.pinned_as_read;
    if (found.excluded >= 0) excluded.push_back(found.excluded);
  });
  if (!pinned_as_read) scene_.invalidate();
  std::sort(excluded.begin(), excluded.end());
  for (const std::int32_t vertex : excluded) exclude(vertex);
  // Obstacles have their own margin about them.
  btScalar margin = static_cast<btScalar>(options_.thickness);
  for (const SoftScene::BodyRecord& record : scene_.bodies())
    if (Obstacles::meets_obstacles(*record.body)) margin = btMax(margin, record.margin);
  if (!near_obstacles_.is_empty())
    near_obstacles_ = near_obstacles_.grown(btVector3(margin, margin, margin));
  return pinned_as_read && excluded.empty();
}

void StepReader::gather_block(const SoftScene::BodyRecord& record, std::int32_t first,
                              std::int32_t last, const Fill& fill, Found& found) {
  for (std::int32_t v = first; v < last; ++v) {
    scene_.fetch_ahead(record, v);
    const btScalar inverse_mass = record.body->m_nodes[scene_.node_index(v)].m_im;
    motion_.inverse_mass[v] = static_cast<double>(inverse_mass);
    motion_.rate[v] = 1 / motion_.dt;
    found.pinned_as_read = found.pinned_as_read && (inverse_mass > 0) != scene_.was_pinned(v);
  }
  fill(scene_, record, first, last, motion_);
  const btScalar way_of_light = static_cast<btScalar>(speed_of_light * motion_.dt);
  for (std::int32_t v = first; v < last; ++v) {
    const btScalar *start = &motion_.start[3 * static_cast<std::size_t>(v)],
                   *end = &motion_.end[3 * static_cast<std::size_t>(v)];
    const btVector3 x0(start[0], start[1], start[2]), x1(end[0], end[1], end[2]);
    // So written that it holds of what is not finite too.
    if (!((x1 - x0).length2() <= way_of_light * way_of_light) && found.excluded < 0)
      found.excluded = v;
    found.swept.add(x0);
    found.swept.add(x1);
  }
}

void StepReader::exclude(std::int32_t vertex) {
  const SoftScene::BodyRecord& record = scene_.bodies()[scene_.body_of(vertex)];
  if (scene_.is_excluded(record.body)) return;
  scene_.exclude(record.body);
  const std::string body = std::to_string(record.world_index);
  warnings_.warn_once("finite " + body,
               "soft body " + body + ", node " + std::to_string(scene_.node_index(vertex)) +
                   ": the position is not finite, or moves faster than light; the body is left out "
                   "of collision detection until that ends");
}

void StepReader::gather_obstacles() {
  motion_.first_vertex.clear();
  motion_.rigid_of_body.clear();
  motion_.rigid.clear();
  motion_.anchored.clear();
  bounds_.resize(scene_.bodies().size());
  motion_.start.resize(3 * static_cast<std::size_t>(topology_.vertex_count()));
  motion_.end.resize(motion_.start.size());
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    motion_.first_vertex.push_back(body.first_vertex);
    motion_.rigid_of_body.push_back(body.soft ? -1
                                              : static_cast<std::int32_t>(motion_.rigid.size()));
    if (body.soft) continue;
    const Obstacles::Record& record = obstacles_.records()[body.obstacle];
    RigidMotion rigid = rigid_motion(*body.object);
    rigid.first_vertex = body.first_vertex;
    rigid.vertex_count = body.vertex_count;
    rigid.local = obstacles_.local().data() + record.first_vertex;
    rigid.start = record.start;
    rigid.predicted = record.end;
    motion_.place_start(rigid);
    motion_.put(rigid, record.end);
    motion_.rigid.push_back(rigid);
    bounds_.push_back(bounds_of(rigid));
  }
  motion_.first_vertex.push_back(topology_.vertex_count());
  find_anchored();
}

AxisBox StepReader::bounds_of(const RigidMotion& rigid) const {
  AxisBox box = AxisBox::empty();
  for (const std::vector<btScalar>* const ends : {&motion_.start, &motion_.end}) {
    const btScalar* x = ends->data() + 3 * static_cast<std::size_t>(rigid.first_vertex);
    for (std::int32_t i = 0; i < rigid.vertex_count; ++i, x += 3)
      box.add(btVector3(x[0], x[1], x[2]));
  }
  return box;
}

bool StepReader::may_meet(double distance) const {
  const std::vector<StepTopology::BodyRecord>& bodies = topology_.bodies();
  const auto is_beyond = [distance](const AxisBox& a, const AxisBox& b, int k) {
    return static_cast<double>(b.lower[k]) - static_cast<double>(a.upper[k]) > distance;
  };
  const auto are_apart = [&](const AxisBox& a, const AxisBox& b, int k) {
    return is_beyond(a, b, k) || is_beyond(b, a, k);
  };
  // What only carries nodes has no surface, and comes last.
  std::vector<std::size_t> order(topology_.topology().bodies.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return bounds_[a].lower.x() < bounds_[b].lower.x();
  });
  for (auto a = order.begin(); a != order.end(); ++a) {
    if (topology_.topology().bodies[*a].self_collision) return true;
    for (auto b = a + 1; b != order.end() && !is_beyond(bounds_[*a], bounds_[*b], 0); ++b) {
      if ((bodies[*a].soft || bodies[*b].soft) && !are_apart(bounds_[*a], bounds_[*b], 1) &&
          !are_apart(bounds_[*a], bounds_[*b], 2))
        return true;
    }
  }
  return false;
}

AxisBox StepReader::starts_near_obstacles() const {
  AxisBox box = AxisBox::empty();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    if (!Obstacles::meets_obstacles(*record.body)) continue;
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v)
      box.add(to_bullet(motion_.start_of(v)));
  }
  return box;
}

void StepReader::find_anchored() {
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    const auto& anchors = record.body->m_deformableAnchors;
    for (int i = 0; i < anchors.size(); ++i) {
      const int node = static_cast<int>(anchors[i].m_node - &record.body->m_nodes[0]);
      const std::int32_t v = scene_.vertex_of(record, node);
      // Pinned nodes push nothing with Bullet's anchors; in the rigid world, these move nothing.
      if (v < 0 || anchors[i].m_node->m_im == 0 || motion_.inverse_mass[v] > 0) continue;
      motion_.anchored.erase(v);  // the last of several has it
      for (std::size_t body = 0; body < topology_.bodies().size(); ++body) {
        const int rigid = motion_.rigid_of_body[body];
        if (topology_.bodies()[body].object == anchors[i].m_cti.m_colObj &&
            motion_.rigid[rigid].is_dynamic())
          motion_.anchored[v] = {anchors[i].m_local, rigid};
      }
    }
  }
}

bool StepReader::read_where_pushed() {
  if (!options_.collide_rigid) return false;
  AxisBox reached = near_obstacles_;
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    if (!Obstacles::meets_obstacles(*record.body)) continue;
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v) {
      const btScalar* const x = &motion_.end[3 * static_cast<std::size_t>(v)];
      reached.add(btVector3(x[0], x[1], x[2]));
    }
  }
  // What has been asked for is not asked for again.
  if (near_obstacles_.contains(reached) || obstacles_.has_read(reached)) return false;
  motion_.restart_response();  // while its rigid bodies have the triangles that they were read with
  near_obstacles_ = reached;
  if (obstacles_.update_region(near_obstacles_))
    obstacles_.read_triangles(starts_near_obstacles(), warnings_);
  topology_.update(scene_, obstacles_, true);
  gather_obstacles();
  return true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
