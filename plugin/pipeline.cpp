#include "pipeline.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>

#include "pair_rules.h"
#include "piercings.h"
#include "rotation.h"
#include "step_contacts.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Says which bodies are new where memory is reused.
int proxy_id(const SoftScene::BodyRecord& record) {
  const btBroadphaseProxy* proxy = record.body->getBroadphaseHandle();
  return proxy ? proxy->m_uniqueId : -1;
}

// Without its place in the motion. Bodies that nothing moves have no mobility.
RigidMotion rigid_motion(const btCollisionObject& object) {
  RigidMotion motion;
  motion.velocity = motion.spin = motion.inverse_mass = Eigen::Vector3d::Zero();
  motion.inverse_inertia = Eigen::Matrix3d::Zero();
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (!body || body->isStaticOrKinematicObject()) return motion;
  motion.velocity = to_eigen(body->getLinearVelocity());
  motion.spin = to_eigen(body->getAngularVelocity());
  motion.inverse_mass = static_cast<double>(body->getInvMass()) * to_eigen(body->getLinearFactor());
  const Eigen::Matrix3d free(to_eigen(body->getAngularFactor()).asDiagonal());
  motion.inverse_inertia = free * to_eigen(body->getInvInertiaTensorWorld()) * free;
  return motion;
}

}  // namespace

Pipeline::Pipeline(const Options& options, Friction friction)
    : options_(options),
      friction_(friction),
      journal_(options.on_message),
      detector_(options.detector, scene_, topology_, motion_,
                [this](std::int32_t a, std::int32_t b) { return surface(a, b); }),
      response_(options, [this](std::int32_t a, std::int32_t b) { return surface(a, b); }) {}

PairSurface Pipeline::surface(std::int32_t body_a, std::int32_t body_b) const {
  const StepTopology::BodyRecord& a = topology_.bodies()[body_a];
  const StepTopology::BodyRecord& b = topology_.bodies()[body_b];
  PairSurface surface;
  surface.thickness =
      std::max(resolution_, options_.thickness >= 0 ? options_.thickness : a.margin + b.margin);
  const auto coefficient = [](const StepTopology::BodyRecord& body) {
    return static_cast<double>(body.soft ? body.soft->m_cfg.kDF : body.object->getFriction());
  };
  // Between soft and rigid bodies Bullet multiplies in both worlds.
  const double fa = coefficient(a), fb = coefficient(b);
  surface.friction = !options_.friction ? 0 : a.soft && b.soft ? friction_(fa, fb) : fa * fb;
  return surface;
}

bool Pipeline::queue_pair(const btSoftBody* a, const btSoftBody* b) noexcept {
  if (!works_ || is_cluster_pair(*a, *b) || !scene_.takes(a) || !scene_.takes(b)) return false;
  ++queued_;
  return true;
}

bool Pipeline::takes(const btSoftBody* body, const btCollisionObject* rigid) const noexcept {
  return options_.rigid_obstacles && options_.rigid_contacts && works_ && scene_.takes(body) &&
         Obstacles::meets_obstacles(*body) && Obstacles::is_whole(*rigid) &&
         body->m_tetras.size() == 0;  // the nodes inside of a volume have no surface
}

void Pipeline::begin_step(const Bodies& bodies) noexcept {
  for (int i = 0; i < bodies.size(); ++i) {
    // Bullet clears the mark of active bodies only; of the others it is part of the scene's stamp.
    if (bodies[i]->m_bUpdateRtCst && bodies[i]->isActive()) scene_.invalidate();
  }
  if (options_.rigid_obstacles) obstacles_.begin_step(bodies);
}

bool Pipeline::run(const Bodies& bodies, double seconds, const Fill& fill) noexcept {
  step_ = StepStats();
  step_.steps = 1;
  step_.queued_pairs = queued_;
  queued_ = 0;
  contacts_.clear();
  responded_ = false;
  try {
    const Clock::time_point start = Clock::now();
    gather(bodies, seconds, fill);
    step_.ms_gather = ms_since(start);
    if (scene_.vertex_count() > 0) {
      const Clock::time_point gathered = Clock::now();
      const auto touching = [this](const Positions& x0, const Positions& x1) {
        return detector_.touching(x0, x1);
      };
      const StepStats before = step_;
      do {
        step_ = before;
        detector_.begin_motion();
        const std::vector<Contact> near = detector_.near();
        responded_ = detector_.found_any();
        if (responded_) {
          response_.run(near, touching, motion_, step_);
        } else {
          response_.forget();
        }
      } while (read_where_pushed());
      step_.unresolved += detector_.count_passed_over();
      if (step_.unresolved > 0) {
        journal_.say(
            "unresolved",
            "a kinematic body passed over pinned nodes, or something as fixed as these; the "
            "contacts are counted as unresolved");
      }
      leave_stopped_obstacles();
      collect_contacts();
      remember_ends();
      detector_.add_to(step_);
      step_.ms_response = ms_since(gathered) - step_.ms_detect;
    }
    works_ = true;
  } catch (const std::exception& error) {
    works_ = false;
    last_ends_.clear();
    contacts_.clear();
    step_.missed_steps = 1;
    journal_.say(error.what(), std::string("the step goes on without LazyCCD: ") + error.what());
  }
  total_ += step_;
  return works_;
}

void Pipeline::gather(const Bodies& bodies, double seconds, const Fill& fill) {
  scene_.readmit(bodies);
  bool changed = false;
  const std::size_t obstacles = obstacles_.records().size();
  do {
    changed = scene_.update(bodies, journal_) || changed;
  } while (!gather_soft(seconds, fill));
  const bool bodies_changed = changed;
  const bool displaced = sweep_driven_nodes();
  if (options_.rigid_obstacles)
    changed = obstacles_.update(bodies, near_obstacles_, journal_) || changed;
  changed = topology_.update(scene_, obstacles_, changed);
  gather_obstacles();
  changed = read_resolution() || changed;
  if (scene_.vertex_count() == 0) return;
  try {
    if (changed) set_topology();
    // Not where only other triangles of the same bodies came near.
    if (bodies_changed || displaced || obstacles_.records().size() > obstacles) report_piercings();
  } catch (...) {
    scene_.invalidate();
    throw;
  }
}

bool Pipeline::sweep_driven_nodes() {
  bool displaced = false;
  auto next = last_ends_.begin();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    const auto is_same = [id = proxy_id(record)](const LastEnd& end) { return end.proxy_id == id; };
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
    if (Obstacles::meets_obstacles(*record.body))
      near_obstacles_.add(came_from.grown(btVector3(record.margin, record.margin, record.margin)));
  }
  return displaced;
}

void Pipeline::remember_ends() {
  last_ends_.resize(scene_.bodies().size());
  for (std::size_t i = 0; i < last_ends_.size(); ++i) {
    const SoftScene::BodyRecord& record = scene_.bodies()[i];
    const auto first = motion_.end.begin() + 3 * static_cast<std::ptrdiff_t>(record.first_vertex);
    last_ends_[i].proxy_id = proxy_id(record);
    last_ends_[i].positions.assign(first,
                                   first + 3 * static_cast<std::ptrdiff_t>(record.vertex_count));
  }
}

bool Pipeline::read_resolution() {
  constexpr double roundings = 16;
  constexpr double least_speed = 4e-4;  // m/s: the response leaves gaps open by a part of it
  if (swept_.is_empty()) return false;
  btScalar farthest = 0;
  for (int k = 0; k < 3; ++k)
    farthest = std::max({farthest, std::abs(swept_.lower[k]), std::abs(swept_.upper[k])});
  const double rounding =
      static_cast<double>(farthest) * static_cast<double>(std::numeric_limits<btScalar>::epsilon());
  const double resolution = roundings * rounding + least_speed * motion_.seconds;
  if (resolution <= resolution_ && 4 * resolution >= resolution_) return false;
  resolution_ = 2 * resolution;
  return true;
}

void Pipeline::set_topology() {
  response_.forget();
  detector_.set_topology(largest_thickness());
}

void Pipeline::report_piercings() {
  const Piercings found = find_piercings(topology_.topology(), detector_.edges(), motion_.starts());
  step_.pierced_at_start = found.count;
  if (found.count == 0) return;
  const auto name = [this](std::int32_t body) {
    return topology_.bodies()[body].soft
               ? "soft body " + std::to_string(scene_.bodies()[body].world_index)
               : std::string("a rigid body");
  };
  journal_.say("pierced " + name(found.first[0]) + name(found.first[1]),
               "bodies intersect where a step begins: " + std::to_string(found.count) +
                   " edges stick in faces, the first of " + name(found.first[0]) + " in " +
                   name(found.first[1]) +
                   "; what is on the wrong side stays there, and no more comes to it");
}

double Pipeline::largest_thickness() const {
  if (options_.thickness >= 0) return std::max(resolution_, options_.thickness);
  // Of two soft bodies, or of a soft body and an obstacle.
  std::vector<double> soft = {0}, all = {0};
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    if (body.soft) soft.push_back(body.margin);
    all.push_back(body.margin);
  }
  const double softest = *std::max_element(soft.begin(), soft.end());
  return std::max(resolution_, softest + *std::max_element(all.begin(), all.end()));
}

// One way through Bullet's nodes, which lie far apart in memory: blocks as small as the processor's
// nearest cache are read, and looked at while they are there. False where the scene is to be read
// anew: something was refused, or other nodes are pinned.
bool Pipeline::gather_soft(double seconds, const Fill& fill) {
  const std::size_t count = static_cast<std::size_t>(scene_.vertex_count());
  motion_.seconds = seconds;
  motion_.start.resize(3 * count);
  motion_.end.resize(3 * count);
  motion_.velocity.resize(count);
  motion_.rate.resize(count);
  motion_.inverse_mass.resize(count);
  swept_ = near_obstacles_ = AxisBox::empty();
  btScalar margin = static_cast<btScalar>(options_.thickness);
  constexpr std::int32_t block = 128;
  bool as_read = true;
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    AxisBox swept = AxisBox::empty();
    const std::int32_t end = record.first_vertex + record.vertex_count;
    for (std::int32_t first = record.first_vertex; first < end; first += block) {
      if (gather_block(record, first, std::min(end, first + block), fill, swept)) continue;
      as_read = false;
      break;
    }
    swept_.add(swept);
    if (!Obstacles::meets_obstacles(*record.body)) continue;
    near_obstacles_.add(swept);
    margin = btMax(margin, record.margin);
  }
  // Obstacles have their own margin about them.
  if (!near_obstacles_.is_empty())
    near_obstacles_ = near_obstacles_.grown(btVector3(margin, margin, margin));
  return as_read;
}

bool Pipeline::gather_block(const SoftScene::BodyRecord& record, std::int32_t first,
                            std::int32_t last, const Fill& fill, AxisBox& swept) {
  bool pinned_as_read = true;
  for (std::int32_t v = first; v < last; ++v) {
    scene_.fetch_ahead(record, v);
    const btScalar inverse_mass = record.body->m_nodes[scene_.node_index(v)].m_im;
    motion_.inverse_mass[v] = static_cast<double>(inverse_mass);
    motion_.rate[v] = 1 / motion_.seconds;
    pinned_as_read = pinned_as_read && (inverse_mass > 0) != scene_.was_pinned(v);
  }
  if (!pinned_as_read) {
    scene_.invalidate();
    return false;
  }
  fill(scene_, record, first, last, motion_);
  for (std::int32_t v = first; v < last; ++v) {
    const btScalar *start = &motion_.start[3 * static_cast<std::size_t>(v)],
                   *end = &motion_.end[3 * static_cast<std::size_t>(v)];
    const btVector3 x0(start[0], start[1], start[2]), x1(end[0], end[1], end[2]);
    // Times a number that is not finite is not zero.
    if (!(x0.dot(btVector3(0, 0, 0)) + x1.dot(btVector3(0, 0, 0)) == 0)) {
      refuse(record, v);
      return false;
    }
    swept.add(x0);
    swept.add(x1);
  }
  return true;
}

void Pipeline::refuse(const SoftScene::BodyRecord& record, std::int32_t vertex) {
  scene_.refuse(record.body);
  const std::string body = std::to_string(record.world_index);
  journal_.say("finite " + body,
               "soft body " + body + ", node " + std::to_string(scene_.node_index(vertex)) +
                   ": the position is not finite; the body is left out of collision detection "
                   "until it is");
}

void Pipeline::gather_obstacles() {
  motion_.first_vertex.clear();
  motion_.rigid_of_body.clear();
  motion_.rigid.clear();
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
    rigid.local = &obstacles_.local()[record.first_vertex];
    rigid.start = record.start;
    rigid.predicted = record.end;
    motion_.place_start(rigid);
    motion_.put(rigid, record.end);
    motion_.rigid.push_back(rigid);
  }
  motion_.first_vertex.push_back(topology_.vertex_count());
}

bool Pipeline::read_where_pushed() {
  if (!responded_ || !options_.rigid_obstacles) return false;
  AxisBox reached = near_obstacles_;
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    if (!Obstacles::meets_obstacles(*record.body)) continue;
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v) {
      const btScalar* const x = &motion_.end[3 * static_cast<std::size_t>(v)];
      reached.add(btVector3(x[0], x[1], x[2]));
    }
  }
  if (obstacles_.has_read(reached)) return false;
  motion_.restart_response();  // while its rigid bodies have the triangles that they were read with
  near_obstacles_ = reached;
  obstacles_.read(near_obstacles_, journal_);
  topology_.update(scene_, obstacles_, true);
  gather_obstacles();
  set_topology();
  return true;
}

void Pipeline::collect_contacts() {
  static const std::vector<ContactRow> none;
  contacts_ = step_contacts(responded_ ? response_.rows() : none, detector_.silent(), scene_,
                            topology_, motion_);
  for (const StepContact& contact : contacts_) {
    ++(contact.kind == ContactKind::vertex_face ? step_.contacts_vf : step_.contacts_ee);
  }
}

void Pipeline::announce() noexcept try {
  if (options_.on_contacts && !contacts_.empty()) options_.on_contacts(contacts_);
} catch (const std::exception& error) {
  journal_.say("on_contacts", std::string("on_contacts threw: ") + error.what());
}

bool Pipeline::is_moved(std::int32_t vertex) const {
  return responded_ && (!motion_.velocity_change[vertex].isZero(0) ||
                        motion_.solved[vertex] != motion_.predicted[vertex] ||
                        !motion_.opening[vertex].isZero(0));
}

void Pipeline::leave_stopped_obstacles() {
  if (!responded_) return;
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    if (body.soft || body.dynamic) continue;
    const RigidMotion& motion = motion_.rigid_of(body_index(body));
    if (motion.end == motion.predicted) continue;
    obstacles_.leave_behind(*body.object);
    journal_.say("caught",
                 "something was caught between bodies of infinite mass that close in on each "
                 "other; it stays where it was, and a body that goes on overlaps it until there is "
                 "room");
  }
}

std::int32_t Pipeline::body_index(const StepTopology::BodyRecord& body) const {
  return static_cast<std::int32_t>(&body - topology_.bodies().data());
}

void Pipeline::write_rigid_bodies() const {
  if (!responded_) return;
  for (const StepTopology::BodyRecord& record : topology_.bodies()) {
    if (record.soft) continue;
    const RigidMotion& motion = motion_.rigid_of(body_index(record));
    const bool changed = !motion.velocity_change.isZero(0) || !motion.spin_change.isZero(0) ||
                         !(motion.end == motion.predicted);
    if (!motion.is_dynamic() || !changed) continue;
    btRigidBody* body = btRigidBody::upcast(record.object);
    body->setCenterOfMassTransform(motion.end);
    body->setLinearVelocity(body->getLinearVelocity() + to_bullet(motion.velocity_change));
    body->setAngularVelocity(body->getAngularVelocity() + to_bullet(motion.spin_change));
    body->activate(true);
  }
}

std::string Pipeline::status() const {
  std::string text = "LazyCCD: " + detector_.status() + ", " +
                     std::to_string(scene_.bodies().size()) + " soft bodies, " +
                     std::to_string(total_.steps) + " steps, " +
                     std::to_string(total_.last_resorts) + " nodes held as the last resort\n";
  return text + journal_.text();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
