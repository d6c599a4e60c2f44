#include "scene/step_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <set>
#include <utility>

#include "motion/articulated_motion.h"
#include "motion/rounding.h"
#include "scene/collision_filters.h"
#include "scene/rigid_motions.h"
#include "settings.h"
#include "shapes/enclosing_mesh.h"
#include "util/profile.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

// False beyond the coordinates that Bullet and AxisBox take for infinite.
bool is_in_world(const AxisBox& box) {
  const btScalar far = BT_LARGE_FLOAT;
  return AxisBox{btVector3(-far, -far, -far), btVector3(far, far, far)}.contains(box);
}

}  // namespace

void StepReader::begin_step(const Bodies& bodies, bool is_own_solver,
                            const ExcludedBodies::Forces* forces) {
  scene_.excluded().begin_step(bodies, forces, warnings_);
  scene_.refused_pairs().begin_step(bodies, is_own_solver);
  for (int i = 0; i < bodies.size(); ++i) {
    // Bullet clears the mark of active bodies only. For inactive ones SoftScene compares the mark.
    if (bodies[i]->m_bUpdateRtCst && bodies[i]->isActive()) scene_.invalidate(*bodies[i]);
  }
  sleepers_.begin_step(bodies);
  if (options_.collide_rigid) obstacles_.begin_step(bodies);
}

StepReader::Changes StepReader::read(const Bodies& bodies, double dt, const Fill& fill) {
  LAZYCCD_BT_PROFILE("read");
  motion_.input().dt = dt;
  if (options_.collide_rigid) obstacles_.read_poses(bodies, dt, warnings_);
  scene_.forget_changes();
  scene_.refused_pairs().end_dispatch();
  sleepers_.find_members(bodies);
  return read_members(bodies, fill);
}

StepReader::Changes StepReader::read_members(const Bodies& bodies, const Fill& fill) {
  Changes changes;
  do {
    do {
      changes.topology = scene_.update(sleepers_, warnings_) || changes.topology;
    } while (!gather_soft(fill));
    find_sleeping_members();
    sweep_prescribed_nodes(changes);
  } while (sleepers_.take_in(bodies, awake_bounds(), contact_distance()));
  find_obstacle_boxes();
  if (options_.collide_rigid &&
      obstacles_.update(bodies, obstacle_boxes_, depth_in_obstacles(), warnings_)) {
    obstacles_.read_triangles(starts_near_obstacles(), warnings_);
    changes.topology = true;
  }
  const ScratchVector<char> placed_obstacles = find_placed_obstacles();
  if (options_.untangling_speed > 0 &&
      read_meshes_around(changes.changed_bodies, placed_obstacles) &&
      obstacles_.update_regions(obstacle_boxes_, warnings_)) {
    obstacles_.read_triangles(starts_near_obstacles(), warnings_);
    changes.topology = true;
  }
  if (changes.topology) look_for_algorithms();
  changes.topology = topology_.update(scene_, obstacles_, changes.topology);
  gather_obstacles();
  update_resolution();
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    if (body.soft || !placed_obstacles[static_cast<std::size_t>(body.obstacle)]) continue;
    changes.changed_bodies.push_back(topology_.index_of(body));
    changes.placed_bodies.push_back(topology_.index_of(body));
  }
  return changes;
}

// Bullet chooses algorithms by the types of shapes.
void StepReader::look_for_algorithms() {
  if (scene_.bodies().empty()) return;
  const btSoftBody& soft = *scene_.bodies()[0].body;
  scene_.refused_pairs().look_for_algorithm(soft, soft);
  std::set<int> seen;
  for (const Obstacles::Record& record : obstacles_.records()) {
    if (seen.insert(record.shape->getShapeType()).second)
      scene_.refused_pairs().look_for_algorithm(soft, *record.object);
  }
}

bool StepReader::reread_if_sleepers_reached(const Bodies& bodies, const Fill& fill,
                                            Changes& changes) {
  if (sleepers_.left_out_count() == 0 ||
      !sleepers_.take_in(bodies, moved_bounds(), contact_distance()))
    return false;
  motion_.restart_response();
  changes = read_members(bodies, fill);
  return true;
}

void StepReader::end_step() {
  for (const StepTopology::BodyRecord& body : topology_.bodies()) {
    if (!body.soft && body.dynamic)
      obstacles_.set_response_end(obstacles_.records()[body.obstacle].unique_id,
                                  motion_.rigid_of(topology_.index_of(body)).end);
  }
  if (std::any_of(motion_.articulated.begin(), motion_.articulated.end(),
                  [](const ArticulatedMotion& body) { return body.is_changed(); }))
    obstacles_.take_link_ends();
  previous_.remember(scene_, sleepers_, obstacles_, topology_, motion_);
  sleepers_.end_step(awake_bounds(), contact_distance());
}

// More than what contacts need, because the bounds of sleepers are never updated.
btScalar StepReader::contact_distance() const {
  btScalar margin = sleepers_.largest_margin();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) margin = btMax(margin, record.margin);
  const btScalar thickness =
      options_.thickness >= 0 ? static_cast<btScalar>(options_.thickness) : 2 * margin;
  return settings::sleeping::reach_factor * thickness;
}

Sleepers::Boxes StepReader::awake_bounds() const {
  Sleepers::Boxes boxes = obstacles_.moving_bounds();
  for (std::size_t i = 0; i < scene_.bodies().size(); ++i)
    if (!at_rest_[i] || !stands_still(scene_.bodies()[i])) {
      const auto reach = settings::sleeping::reach_factor *
                         static_cast<btScalar>(resolution(*scene_.bodies()[i].body));
      boxes.push_back(bounds_[i].expanded(btVector3(reach, reach, reach)));
    }
  return boxes;
}

Sleepers::Boxes StepReader::moved_bounds() const {
  Sleepers::Boxes boxes;
  for (std::size_t i = 0; i < scene_.bodies().size(); ++i) {
    const SoftScene::BodyRecord& record = scene_.bodies()[i];
    if (stands_still(record)) continue;
    AxisBox box = bounds_[i];
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v)
      box.add(to_bullet(motion_.end_of(v)));
    boxes.push_back(box);
  }
  for (const RigidMotion& rigid : motion_.rigid())
    if (!(rigid.end == rigid.predicted)) boxes.push_back(bounds_of(rigid));
  return boxes;
}

bool StepReader::stands_still(const SoftScene::BodyRecord& record) const {
  const auto first = 3 * static_cast<std::ptrdiff_t>(record.first_vertex),
             last = first + 3 * static_cast<std::ptrdiff_t>(record.vertex_count);
  return std::equal(motion_.start().begin() + first, motion_.start().begin() + last,
                    motion_.end.begin() + first);
}

void StepReader::find_sleeping_members() {
  at_rest_.assign(scene_.bodies().size(), 0);
  auto member = sleepers_.members().begin();
  for (std::size_t i = 0; i < scene_.bodies().size(); ++i) {
    while (member->body != scene_.bodies()[i].body) ++member;
    at_rest_[i] = member->sleeps;
  }
}

void StepReader::find_obstacles_at_rest() {
  at_rest_.resize(scene_.bodies().size());
  for (std::size_t i = at_rest_.size(); i < topology_.bodies().size(); ++i) {
    const StepTopology::BodyRecord& body = topology_.bodies()[i];
    const RigidMotion& rigid = motion_.rigid_of(static_cast<std::int32_t>(i));
    at_rest_.push_back(rigid.stands_still() && !(body.dynamic && body.object->isActive()));
  }
}

double StepReader::depth_in_obstacles() const {
  double smallest_margin = std::numeric_limits<double>::infinity();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    if (record.meets_rigid)
      smallest_margin = std::min(smallest_margin, static_cast<double>(record.margin));
  }
  return settings::shapes::depth_of_thickness *
         (options_.thickness >= 0 ? options_.thickness : smallest_margin);
}

void StepReader::sweep_prescribed_nodes(Changes& changes) {
  changes.changed_bodies.clear();
  changes.placed_bodies.clear();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    const std::vector<btScalar>* const last = previous_.end_of(record);
    const auto body = static_cast<std::int32_t>(index_of(record));
    const bool is_placed = !last || sweep_prescribed_nodes(record, *last);
    if (is_placed) changes.placed_bodies.push_back(body);
    if (is_placed || scene_.is_changed(*record.body)) changes.changed_bodies.push_back(body);
  }
}

bool StepReader::sweep_prescribed_nodes(const SoftScene::BodyRecord& record,
                                        const std::vector<btScalar>& last) {
  btScalar* const start = &motion_.input().start[3 * static_cast<std::size_t>(record.first_vertex)];
  if (std::equal(start, start + last.size(), last.begin())) return false;
  bool free_moved = false;
  for (std::size_t i = 0; i < last.size(); ++i) {
    const std::size_t v = static_cast<std::size_t>(record.first_vertex) + i / 3;
    free_moved = free_moved || (motion_.inverse_mass()[v] > 0 && start[i] != last[i]);
  }
  // Where an application restores a state, soft bodies lie on bodies that it moved too.
  if (free_moved) {
    const btScalar gap = contact_distance();
    obstacles_.let_driven_jump(bounds_[index_of(record)].expanded(btVector3(gap, gap, gap)));
  }
  if (free_moved || pinned_nodes_jumped(record, last)) return true;
  AxisBox came_from = AxisBox::empty();
  std::copy(last.begin(), last.end(), start);
  for (std::size_t i = 0; i < last.size(); i += 3)
    came_from.add(btVector3(start[i], start[i + 1], start[i + 2]));
  bounds_[index_of(record)].add(came_from);
  return false;
}

// True if a pinned node moved farther than its velocity, or twice the last step, and jump_speed
// explain.
bool StepReader::pinned_nodes_jumped(const SoftScene::BodyRecord& record,
                                     const std::vector<btScalar>& last) const {
  const btScalar dt = static_cast<btScalar>(motion_.dt());
  const btScalar explained =
      settings::displacement::max_pinned_growth * previous_.pinned_displacement() +
      static_cast<btScalar>(options_.jump_speed) * dt;
  for (std::int32_t i = 0; i < record.vertex_count; ++i) {
    const btScalar* const from = &last[3 * static_cast<std::size_t>(i)];
    const std::int32_t v = record.first_vertex + i;
    const btScalar moved =
        btVector3(from[0], from[1], from[2]).distance(to_bullet(motion_.start_of(v)));
    if (moved > explained &&
        moved > explained + settings::displacement::pinned_steps_of_velocity * dt *
                                static_cast<btScalar>(motion_.velocity()[v].norm()))
      return true;
  }
  return false;
}

double StepReader::needed_thickness(btScalar farthest) const {
  // A gap is a weighted sum of the places of all vertices of a contact.
  constexpr double vertices = std::tuple_size_v<decltype(Contact::vertices)>;
  return vertices * rounding_of(static_cast<double>(farthest)) +
         settings::detection::resolved_speed * motion_.dt();
}

void StepReader::update_resolution() {
  std::unordered_map<const btSoftBody*, double> last;
  if (resolution_of_.size() > scene_.bodies().size()) last.swap(resolution_of_);
  for (std::size_t i = 0; i < scene_.bodies().size(); ++i) {
    const btSoftBody* const body = scene_.bodies()[i].body;
    if (bounds_[i].is_empty()) continue;
    btScalar farthest = 0;
    for (int k = 0; k < 3; ++k)
      farthest = std::max({farthest, std::abs(bounds_[i].lower[k]), std::abs(bounds_[i].upper[k])});
    const double resolution = needed_thickness(farthest);
    const auto found = last.find(body);
    double& kept =
        found == last.end() ? resolution_of_[body] : resolution_of_[body] = found->second;
    if (resolution > kept || settings::detection::resolution_excess * resolution < kept)
      kept = settings::detection::resolution_spare * resolution;
  }
}

double StepReader::resolution(const btSoftBody& body) const {
  const auto found = resolution_of_.find(&body);
  return found == resolution_of_.end() ? 0 : found->second;
}

double StepReader::largest_resolution(double known) const {
  double largest = 0;
  for (std::size_t i = 0; i < scene_.bodies().size(); ++i) {
    btSoftBody& body = *scene_.bodies()[i].body;
    const double needed = resolution(body);
    if (!(needed > std::max(known, largest))) continue;
    const auto reach = static_cast<btScalar>(settings::detection::distance_factor * needed);
    const AxisBox near = bounds_[i].expanded(btVector3(reach, reach, reach));
    bool meets = body.useSelfCollision();
    for (std::size_t k = 0; k < bounds_.size(); ++k)
      meets = meets || (k != i && near.overlaps(bounds_[k]));
    if (meets) largest = needed;
  }
  return largest;
}

void StepReader::find_obstacle_boxes() {
  obstacle_boxes_.clear();
  // Margins of soft bodies only: the bounds of obstacles (getAabb) include their own.
  btScalar margin = static_cast<btScalar>(options_.thickness);
  for (const SoftScene::BodyRecord& record : scene_.bodies())
    if (record.meets_rigid) margin = btMax(margin, record.margin);
  for (std::size_t i = 0; i < scene_.bodies().size(); ++i)
    if (scene_.bodies()[i].meets_rigid && !bounds_[i].is_empty())
      obstacle_boxes_.push_back(bounds_[i].expanded(btVector3(margin, margin, margin)));
}

// Reads Bullet's nodes in one pass. Returns false if the scene must be read again, because a body
// was excluded or other nodes are pinned than before.
bool StepReader::gather_soft(const Fill& fill) {
  const std::size_t count = static_cast<std::size_t>(scene_.vertex_count());
  motion_.input().start.resize(3 * count);
  motion_.end.resize(3 * count);
  motion_.input().velocity.resize(count);
  motion_.input().rate.resize(count);
  motion_.input().inverse_mass.resize(count);
  bounds_.assign(scene_.bodies().size(), AxisBox::empty());
  ScratchVector<const btSoftBody*> pinned_elsewhere;
  ScratchVector<std::int32_t> bad_vertices;
  std::mutex mutex;
  scene_.for_each_range(
      threads_, [&](const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last) {
        // Each block fits into the first-level cache, so that its second pass finds it there.
        constexpr std::int32_t block = 128;  // vertices
        Found found;
        for (; first < last; first += block)
          gather_block(record, first, std::min(last, first + block), fill, found);
        const std::lock_guard<std::mutex> lock(mutex);
        bounds_[index_of(record)].add(found.swept);
        if (!found.pins_unchanged) pinned_elsewhere.push_back(record.body);
        if (found.bad_vertex >= 0) bad_vertices.push_back(found.bad_vertex);
      });
  for (const btSoftBody* const body : pinned_elsewhere) scene_.invalidate(*body);
  std::sort(bad_vertices.begin(), bad_vertices.end());
  for (const std::int32_t vertex : bad_vertices) exclude(vertex);
  return pinned_elsewhere.empty() && bad_vertices.empty();
}

void StepReader::gather_block(const SoftScene::BodyRecord& record, std::int32_t first,
                              std::int32_t last, const Fill& fill, Found& found) {
  for (std::int32_t v = first; v < last; ++v) {
    scene_.prefetch_node(record, v);
    const btScalar inverse_mass = record.body->m_nodes[scene_.node_index(v)].m_im;
    motion_.input().inverse_mass[v] = static_cast<double>(inverse_mass);
    motion_.input().rate[v] = 1 / motion_.dt();
    found.pins_unchanged = found.pins_unchanged && (inverse_mass > 0) != scene_.was_pinned(v);
  }
  fill(scene_, record, first, last, motion_);
  // Of any body, as everything is farther from the origin than that.
  const auto usual = static_cast<btScalar>(longest_step(record, btVector3(0, 0, 0)));
  for (std::int32_t v = first; v < last; ++v) {
    const btScalar *start = &motion_.start()[3 * static_cast<std::size_t>(v)],
                   *end = &motion_.end[3 * static_cast<std::size_t>(v)];
    const btVector3 x0(start[0], start[1], start[2]), x1(end[0], end[1], end[2]);
    // Negated, so that the condition is also true for positions that are not finite.
    if (!((x1 - x0).length2() <= usual * usual) && found.bad_vertex < 0 &&
        !(static_cast<double>((x1 - x0).length()) <= longest_step(record, x0)))
      found.bad_vertex = v;
    found.swept.add(x0);
    found.swept.add(x1);
  }
  if (found.bad_vertex < 0 && !is_in_world(found.swept)) found.bad_vertex = first;
}

double StepReader::longest_step(const SoftScene::BodyRecord& record, const btVector3& start) const {
  const double thickness = std::max(
      options_.thickness >= 0 ? options_.thickness : 2 * static_cast<double>(record.margin),
      needed_thickness(start.absolute()[start.absolute().maxAxis()]));
  return std::min({settings::displacement::max_node_speed * motion_.dt(),
                   settings::displacement::max_node_displacement,
                   settings::displacement::resolved_part * thickness /
                       static_cast<double>(std::numeric_limits<btScalar>::epsilon())});
}

void StepReader::exclude(std::int32_t vertex) {
  const SoftScene::BodyRecord& record = scene_.bodies()[scene_.body_of(vertex)];
  const bool is_finite = (motion_.end_of(vertex) - motion_.start_of(vertex)).allFinite();
  scene_.excluded().add(*record.body, record.world_index, scene_.node_index(vertex),
                        is_finite ? ExclusionReason::unresolved_step : ExclusionReason::not_finite,
                        warnings_,
                        longest_step(record, to_bullet(motion_.start_of(vertex))) / motion_.dt());
}

void StepReader::gather_obstacles() {
  read_rigid_motions(topology_, obstacles_, motion_);
  find_anchored_vertices(scene_, motion_);
  find_obstacles_at_rest();
  bounds_.resize(scene_.bodies().size());
  for (const RigidMotion& rigid : motion_.rigid()) bounds_.push_back(bounds_of(rigid));
}

AxisBox StepReader::bounds_of(const RigidMotion& rigid) const {
  AxisBox box = AxisBox::empty();
  for (const std::vector<btScalar>* const ends : {&motion_.start(), &motion_.end}) {
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
  // Only bodies with a surface. Obstacles without one come last in bodies() and are not in
  // topology().
  const Span<const Body> filters = topology_.topology().bodies;
  ScratchVector<std::size_t> order(filters.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return bounds_[a].lower.x() < bounds_[b].lower.x();
  });
  for (auto a = order.begin(); a != order.end(); ++a) {
    if (filters[*a].self_collision) return true;
    for (auto b = a + 1; b != order.end() && !is_beyond(bounds_[*a], bounds_[*b], 0); ++b) {
      if ((bodies[*a].soft || bodies[*b].soft) && filters_accept(filters[*a], filters[*b]) &&
          !are_apart(bounds_[*a], bounds_[*b], 1) && !are_apart(bounds_[*a], bounds_[*b], 2))
        return true;
    }
  }
  return false;
}

Obstacles::Boxes StepReader::starts_near_obstacles() const {
  Obstacles::Boxes boxes;
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    if (!record.meets_rigid) continue;
    boxes.push_back(AxisBox::empty());
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v)
      boxes.back().add(to_bullet(motion_.start_of(v)));
  }
  return boxes;
}

// An obstacle that only comes near cannot start in a soft body.
ScratchVector<char> StepReader::find_placed_obstacles() const {
  const std::vector<Obstacles::Record>& records = obstacles_.records();
  ScratchVector<char> placed;
  for (const Obstacles::Record& record : records) placed.push_back(previous_.is_new(record));
  if (std::none_of(placed.begin(), placed.end(), [](char is_placed) { return is_placed != 0; }))
    return placed;
  const btScalar spare = contact_distance();
  Obstacles::Boxes starts = starts_near_obstacles();
  for (AxisBox& box : starts) box = box.expanded(btVector3(spare, spare, spare));
  for (std::size_t i = 0; i < records.size(); ++i) {
    AxisBox box;
    records[i].shape->getAabb(records[i].start, box.lower, box.upper);
    placed[i] = placed[i] && overlaps_any(starts, box);
  }
  return placed;
}

bool StepReader::read_meshes_around(const std::vector<std::int32_t>& changed_bodies,
                                    Span<const char> placed_obstacles) {
  const auto is_set = [](char placed) { return placed != 0; };
  if (changed_bodies.empty() &&
      std::none_of(placed_obstacles.begin(), placed_obstacles.end(), is_set))
    return false;
  bool any = false;
  for (std::size_t i = 0; i < obstacles_.records().size(); ++i) {
    const Obstacles::Record& record = obstacles_.records()[i];
    if (obstacles_.reads_whole_mesh(record) || !is_cut_to_region(*record.shape)) continue;
    const auto is_around = [&](const SoftScene::BodyRecord& body) {
      const bool is_placed = placed_obstacles[i] != 0 ||
                             std::binary_search(changed_bodies.begin(), changed_bodies.end(),
                                                static_cast<std::int32_t>(index_of(body)));
      return is_placed && body.meets_rigid && may_collide(*body.body, *record.object) &&
             !scene_.refused_pairs().contains(*body.body, *record.object) &&
             may_be_inside(body, record);
    };
    if (std::none_of(scene_.bodies().begin(), scene_.bodies().end(), is_around)) continue;
    obstacles_.read_whole_mesh(record.unique_id);
    any = true;
  }
  return any;
}

// Looks at some of the nodes. If a body is inside with other nodes alone, its surface passes
// through the mesh, which shows anyway.
bool StepReader::may_be_inside(const SoftScene::BodyRecord& body,
                               const Obstacles::Record& obstacle) const {
  const std::int32_t step = 1 + (body.vertex_count - 1) / settings::shapes::inside_samples;
  for (std::int32_t i = 0; i < body.vertex_count; i += step) {
    const btVector3 x = to_bullet(motion_.start_of(body.first_vertex + i));
    if (may_be_inside_mesh(*obstacle.shape, obstacle.start.invXform(x))) return true;
  }
  return false;
}

bool StepReader::reread_obstacles_if_left() {
  if (!options_.collide_rigid) return false;
  Obstacles::Boxes reached = obstacle_boxes_;
  auto box = reached.begin();
  for (std::size_t i = 0; i < scene_.bodies().size(); ++i) {
    const SoftScene::BodyRecord& record = scene_.bodies()[i];
    if (!record.meets_rigid || bounds_[i].is_empty()) continue;
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v) {
      const btScalar* const x = &motion_.end[3 * static_cast<std::size_t>(v)];
      box->add(btVector3(x[0], x[1], x[2]));
    }
    ++box;
  }
  // The obstacles of these regions have been read already.
  const auto was_read = [](const AxisBox& now, const AxisBox& read) { return read.contains(now); };
  if (std::equal(reached.begin(), reached.end(), obstacle_boxes_.begin(), was_read) ||
      obstacles_.has_read(reached))
    return false;
  motion_.restart_response();  // before the triangles of its rigid bodies change
  obstacle_boxes_ = std::move(reached);
  if (obstacles_.update_regions(obstacle_boxes_, warnings_))
    obstacles_.read_triangles(starts_near_obstacles(), warnings_);
  topology_.update(scene_, obstacles_, true);
  gather_obstacles();
  return true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
