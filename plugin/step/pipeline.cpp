#include "step/pipeline.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>

#include "lazyccd/debug/assert.h"
#include "lazyccd/debug/stopwatch.h"
#include "motion/articulated_motion.h"
#include "report/step_contacts.h"
#include "scene/collision_filters.h"
#include "step/debug_draw.h"
#include "step/rigid_supports.h"
#include "untangling/intersections.h"
#include "untangling/pair_rules.h"
#include "untangling/penetrations.h"
#include "util/profile.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

bool fits(const Motion& motion, const StepTopology& topology) {
  const auto vertices = static_cast<std::size_t>(topology.vertex_count());
  return motion.start().size() == 3 * vertices && motion.end.size() == 3 * vertices &&
         motion.soft_count() == topology.soft_count() &&
         motion.rigid_of_body().size() == topology.bodies().size() &&
         motion.first_vertex().size() == topology.bodies().size() + 1;
}

bool is_finite(const Motion& motion) {
  const auto all = [](const std::vector<btScalar>& positions) {
    return std::all_of(positions.begin(), positions.end(),
                       [](btScalar x) { return std::isfinite(x); });
  };
  return all(motion.start()) && all(motion.end);
}

}  // namespace

Pipeline::Pipeline(const CheckedOptions& checked, WorldKind world)
    : options_(checked.options),
      warnings_(options_.on_message),
      threads_(std::max(0, options_.detector.threads)),
      thread_choice_(threads_, options_.detector.threads <= 0),
      reader_(options_, warnings_, threads_),
      surfaces_(options_, world),
      filter_(reader_.scene(), reader_.topology(), reader_.motion(), surfaces_, untangling_),
      detector_(options_.detector, threads_, filter_, reader_.topology(), reader_.motion(),
                surfaces_, options_.position_correction, options_.contact_cache),
      response_(options_, surfaces_, threads_) {
  for (const std::string& line : checked.lines) warnings_.warn_once(line, line);
}

void Pipeline::update_surfaces() {
  ScratchVector<BodySurface> bodies;
  bodies.reserve(topology().bodies().size());
  for (const StepTopology::BodyRecord& body : topology().bodies()) {
    if (body.soft) {
      const btSoftBody::Config& config = body.soft->m_cfg;
      bodies.push_back({body.margin, static_cast<double>(config.kDF), true,
                        static_cast<double>(config.kSHR), config.piterations,
                        reader_.resolution(*body.soft)});
    } else {
      bodies.push_back({body.margin, static_cast<double>(body.object->getFriction()), false});
    }
  }
  surfaces_.update(bodies);
}

bool Pipeline::handle_pair(btSoftBody* a, btSoftBody* b) noexcept {
  reader_.accept_pair(*a, *b);
  if (scene().excluded().contains(a) || scene().excluded().contains(b)) return true;
  if (!ran_last_step_ || is_cluster_pair(*a, *b) || !scene().accepts(a) || !scene().accepts(b))
    return false;
  if (!scene().flags().ask_for(*a, *b)) {
    report_pair_without_flags(*a, *b);
    return false;
  }
  ++handled_pairs_;
  return true;
}

void Pipeline::report_pair_without_flags(btSoftBody& a, btSoftBody& b) noexcept {
  if (reported_pair_without_flags_ || !may_collide(a, b)) return;
  reported_pair_without_flags_ = true;
  // A body whose flags ask for no contact at all is not read, and has no index.
  const int index_a = scene().world_index_of(a), index_b = scene().world_index_of(b);
  const std::string names = index_a < 0 || index_b < 0 ? "two soft bodies"
                                                       : "soft bodies " + std::to_string(index_a) +
                                                             " and " + std::to_string(index_b);
  warnings_.warn_once(
      "flags", names +
                   " overlap, but their collision flags do not let them collide; set VF_SS "
                   "(or VF_DD) in m_cfg.collisions of both, or obey_collision_flags = false");
}

bool Pipeline::replaces_contacts(const btSoftBody* body,
                                 const btCollisionObject* rigid) const noexcept {
  return options_.collide_rigid && options_.replace_rigid_contacts && ran_last_step_ &&
         scene().accepts(body) && scene().flags().ask_for(*body, *rigid) &&
         Obstacles::is_fully_known(*rigid) &&
         (body->m_tetras.size() == 0 || body->m_faces.size() > 0);  // else it has no surface
}

bool Pipeline::handle_pair(const btSoftBody* body, const btCollisionObject* rigid) noexcept {
  reader_.accept_pair(*body, *rigid);
  return scene().excluded().contains(body) || replaces_contacts(body, rigid);
}

void Pipeline::begin_step(const Bodies& bodies, bool is_own_solver,
                          const ExcludedBodies::Forces* forces) noexcept {
  std::size_t nodes = 0;
  for (int i = 0; i < bodies.size(); ++i)
    nodes += static_cast<std::size_t>(bodies[i]->m_nodes.size());
  thread_choice_.begin_step(nodes);
  reader_.begin_step(bodies, is_own_solver, forces);
  motors_.begin_step();
}

void Pipeline::detect_ahead() noexcept try {
  detector_.detect_ahead();
} catch (const std::exception&) {  // the detection of the next step will report the error
}

bool Pipeline::run(const Bodies& bodies, double dt, const Fill& fill, const LinkSolver& links,
                   const std::function<void()>& restart_links) noexcept {
  LAZYCCD_BT_PROFILE("LazyCCD step");
  step_ = StepStats();
  step_.steps = 1;
  step_.single_thread_steps = !thread_choice_.uses_all_threads();
  step_.handled_pairs = handled_pairs_;
  handled_pairs_ = 0;
  contacts_.clear();
  responded_ = false;
  reader_.motion().articulated.clear();  // of the last step; its multibodies may be gone
  try {
    Stopwatch reading;
    response_.begin_step(dt);
    StepReader::Changes changes = reader_.read(bodies, dt, fill);
    LAZYCCD_ASSERT(fits(reader_.motion(), topology()),
                   "the motion has all bodies and vertices of the topology");
    LAZYCCD_ASSERT(is_finite(reader_.motion()), "what is read of the nodes is finite");
    take_changes(changes);
    step_.ms_gather = reading.lap();
    if (scene().vertex_count() > 0) {
      Stopwatch answering;
      const StepStats before = step_;
      resolve_contacts(links, restart_links);
      while (responded_ && reader_.reread_if_sleepers_reached(bodies, fill, changes)) {
        step_ = before;
        take_changes(changes);
        resolve_contacts(links, restart_links);
      }
      finish_step();
      step_.ms_response = answering.lap() - step_.ms_detect;
    } else {
      motors_.forget();
    }
    step_.soft_bodies = static_cast<std::int64_t>(scene().bodies().size());
    step_.sleeping_bodies = reader_.sleepers().left_out_count();
    ran_last_step_ = true;
  } catch (const std::exception& error) {
    give_up(error.what());
  } catch (...) {  // an application's filter may throw anything
    give_up("an exception that is not a std::exception was thrown");
  }
  total_ += step_;
  return ran_last_step_;
}

void Pipeline::resolve_contacts(const LinkSolver& links,
                                const std::function<void()>& restart_links) {
  const auto touching = [this](const Positions& x0, const Positions& x1) {
    return detector_.touching(x0, x1);
  };
  untangle();
  const StepStats before = step_;
  do {
    step_ = before;
    if (restart_links) restart_links();
    detector_.begin_motion();
    const NearContacts near = find_near_contacts();
    responded_ = detector_.found_any() || untangling_.pushes();
    if (responded_) {
      filter_.begin_response();
      const btSoftBodyWorldInfo* const world = scene().bodies()[0].body->getWorldInfo();
      if (world && world->m_dispatcher) find_supports(*world->m_dispatcher, reader_.motion());
      motors_.find(reader_.motion());
      response_.run(near, untangling_.penetrations(), touching, without_pushed_bodies(links),
                    reader_.motion(), step_);
    } else {
      response_.forget();
    }
  } while (reread_obstacles_if_left());
}

// A body that is pushed apart keeps its links as they are: they would pull it back.
LinkSolver Pipeline::without_pushed_bodies(const LinkSolver& links) const {
  if (!links || !untangling_.pushes()) return links;
  LinkSolver others = links;
  others.again = [this, &links](std::int32_t body) {
    return untangling_.moves_apart(body) ? LinkSolver::Again::never : links.again(body);
  };
  return others;
}

void Pipeline::finish_step() {
  LAZYCCD_BT_PROFILE("finish");
  filter_.end_response();
  detector_.find_report_only_contacts();
  step_.unresolved += detector_.count_passed_over();
  if (step_.unresolved > 0) {
    warnings_.warn_once("unresolved",
                        "a kinematic body passed over pinned nodes, or other nodes that cannot "
                        "move; StepStats::unresolved counts these contacts");
  }
  hold_stopped_obstacles();
  collect_contacts();
  if (responded_)
    motors_.end_step(motion());
  else
    motors_.forget();
  reader_.end_step();
  detector_.end_step(responded_);
  detector_.add_to(step_);
}

void Pipeline::write(SoftScene::Visit visit) {
  LAZYCCD_BT_PROFILE("write");
  Stopwatch watch;
  scene().for_each_range(threads_, visit);
  const double ms = watch.lap();
  step_.ms_write += ms;
  total_.ms_write += ms;
}

void Pipeline::give_up(const std::string& why) {
  for (ArticulatedMotion& body : reader_.motion().articulated) body.restart_response();
  ran_last_step_ = false;
  reader_.invalidate_soft_bodies();
  reader_.forget_ends();
  response_.forget();
  motors_.forget();
  contacts_.clear();
  step_.fallback_steps = 1;
  warnings_.warn_once(why, "this step runs without LazyCCD: " + why);
}

void Pipeline::take_changes(const StepReader::Changes& changes) {
  LAZYCCD_BT_PROFILE("take changes");
  if (scene().vertex_count() == 0) return;
  update_surfaces();
  filter_.read_anchors();
  touching_.begin_step();
  try {
    if (changes.topology || detector_.would_change(largest_thickness()))
      set_topology(changes.changed_bodies);
    find_embedded(changes.changed_bodies);
    if (!changes.changed_bodies.empty()) {
      for (const std::int32_t body : changes.changed_bodies) untangling_.place(body);
      if (!changes.placed_bodies.empty()) part_touching(changes.placed_bodies);
      report_intersections(changes.changed_bodies);
    }
  } catch (...) {
    reader_.invalidate_soft_bodies();
    throw;
  }
}

bool Pipeline::reread_obstacles_if_left() {
  if (!responded_ || !reader_.reread_obstacles_if_left()) return false;
  update_surfaces();
  set_topology({});
  if (untangling_.pushes())
    untangling_.read(find_intersections(), topology().topology(), detector_.edges(), motion());
  surfaces_.set_moved_apart(untangling_.pairs());
  return true;
}

NearContacts Pipeline::find_near_contacts() {
  if (!untangling_.pushes() && !reader_.may_meet(detector_.separation())) {
    detector_.forget_near();
    return {};
  }
  filter_.set_at_rest(reader_.at_rest());
  return detector_.detect_near(response_.last_impulses());
}

void Pipeline::set_topology(const std::vector<std::int32_t>& changed_bodies) {
  const Renumbering numbers = scene_numbers_.update(topology());
  response_.renumber(numbers);
  untangling_.set_ids(topology().ids());
  embedded_.set_topology(topology(), reader_.sleepers().left_out_count() > 0);
  filter_.set_embedded(embedded_.parts(), embedded_.pinned());
  detector_.set_lengths(largest_thickness(), numbers, changed_bodies);
  filter_.set_topology();
  detector_.set_topology(numbers, changed_bodies);
}

void Pipeline::find_embedded(const std::vector<std::int32_t>& changed_bodies) {
  if (!changed_bodies.empty()) {
    const Topology view = topology().topology();
    const std::function<bool(std::int32_t)> responds = [this](std::int32_t body) {
      return topology().bodies()[body].responds;
    };
    const PairRules pair_rules(view, responds);
    embedded_.find_pinned(topology(), motion(), changed_bodies,
                          [&](std::int32_t body, std::int32_t obstacle) {
                            return pair_rules.collide(body, obstacle);
                          });
  }
  const bool has_changed = embedded_.forget_left(topology(), motion());
  if (has_changed || !changed_bodies.empty())
    filter_.set_embedded(embedded_.parts(), embedded_.pinned());
}

void Pipeline::update_trapped(const Untangling::Found& found) {
  if (options_.untangling_speed > 0 &&
      embedded_.update_trapped(topology(), motion(), found.penetrations))
    filter_.set_embedded(embedded_.parts(), embedded_.pinned());
}

Intersections Pipeline::find_piercing(const std::vector<std::int32_t>* of_bodies) const {
  return bullet::find_intersections(
      topology().topology(), detector_.edges(), motion().starts(),
      [this](std::int32_t body) { return topology().bodies()[body].responds; },
      [this](const Edge& edge, const Face& face) { return filter_.ignores(edge, face); },
      of_bodies);
}

Untangling::Found Pipeline::find_intersections(const std::vector<std::int32_t>* of_bodies) const {
  const Topology view = topology().topology();
  Untangling::Found found;
  found.intersections = find_piercing(of_bodies);
  const std::function<bool(std::int32_t)> responds = [this](std::int32_t body) {
    return topology().bodies()[body].responds;
  };
  const PairRules pair_rules(view, responds);
  found.penetrations = find_penetrations(
      topology(), found.intersections, detector_.edges(), motion(),
      [&](std::int32_t body, std::int32_t obstacle) {
        return untangling_.is_placed(body, obstacle) && pair_rules.collide(body, obstacle);
      },
      [this](std::int32_t vertex, std::int32_t body) { return filter_.is_anchored(vertex, body); });
  return found;
}

void Pipeline::part_touching(const std::vector<std::int32_t>& of_bodies) {
  const Topology view = topology().topology();
  const std::function<bool(std::int32_t)> responds = [this](std::int32_t body) {
    return topology().bodies()[body].responds;
  };
  const PairRules pair_rules(view, responds);
  TouchingQuery query;
  query.collide = [&](std::int32_t a, std::int32_t b) { return pair_rules.collide(a, b); };
  query.responds = [this](const Contact& contact) { return filter_.can_respond(contact); };
  query.touching = [this](const Positions& start, const Positions& end) {
    return detector_.touching_in(start, end);
  };
  query.piercing = [&] {
    std::vector<std::array<std::int32_t, 5>> found;
    for (const auto& [edge, face] : find_piercing(&of_bodies).pairs) {
      const Edge& e = detector_.edges()[edge];
      const Face& f = view.faces[face];
      found.push_back({e[0], e[1], f[0], f[1], f[2]});
    }
    std::sort(found.begin(), found.end());
    return found;
  };
  query.of_bodies = &of_bodies;
  touching_.part(topology(), detector_.edges(), query, reader_.motion());
}

void Pipeline::untangle() {
  LAZYCCD_BT_PROFILE("untangle");
  untangling_.skip_step();
  if (untangling_.is_in_progress()) {
    // What comes out may end within rounding of the surface.
    std::vector<std::int32_t> placed;
    const auto count = static_cast<std::int32_t>(topology().topology().bodies.size());
    for (std::int32_t body = 0; body < count; ++body)
      if (untangling_.is_placed(body, body)) placed.push_back(body);
    part_touching(placed);
    const Untangling::Found found = find_intersections();
    update_trapped(found);
    untangling_.begin_step(found, topology().topology(), detector_.edges(), motion());
    untangling_.push(options_.untangling_speed * motion().dt(), reader_.motion());
  }
  untangling_.finish();
  surfaces_.set_moved_apart(untangling_.pairs());
  // Whether a mesh is closed does not show otherwise.
  if (!untangling_.is_in_progress()) reader_.read_parts_of_meshes();
  for (const BodyPair& pair : untangling_.pairs())
    for (const std::int32_t body : pair) reader_.read_whole_mesh(body);
}

// Other bodies intersect only where contacts were left over, or where that was given up before.
void Pipeline::report_intersections(const std::vector<std::int32_t>& changed_bodies) {
  const bool others_may_intersect = untangling_.is_in_progress() || total_.unresolved > 0;
  const Untangling::Found found =
      find_intersections(others_may_intersect ? nullptr : &changed_bodies);
  update_trapped(found);
  step_.initial_intersections = static_cast<std::int64_t>(found.intersections.pairs.size());
  if (found.empty()) return;
  if (options_.untangling_speed > 0) untangling_.start();
  if (found.intersections.pairs.empty()) return;
  const auto name = [this](std::int32_t body) {
    return topology().bodies()[body].soft
               ? "soft body " + std::to_string(scene().bodies()[body].world_index)
               : std::string("a rigid body");
  };
  const BodyPair& first = found.intersections.first;
  warnings_.warn_once(
      "intersection " + name(first[0]) + name(first[1]),
      "bodies intersect at the start of a step: " +
          std::to_string(found.intersections.pairs.size()) +
          " edges pass through faces, the first of " + name(first[0]) + " through " +
          name(first[1]) +
          (options_.untangling_speed > 0
               ? "; they are moved apart"
               : "; parts on the wrong side stay there, and no further parts get there"));
}

double Pipeline::largest_thickness() const {
  const double wanted = options_.thickness >= 0 ? options_.thickness : topology().largest_margins();
  return std::max(wanted, reader_.largest_resolution(wanted));
}

void Pipeline::collect_contacts() {
  static const std::vector<const ContactRow*> none;
  make_step_contacts(responded_ ? response_.active_rows() : none, detector_.report_only_contacts(),
                     scene(), topology(), motion(), threads_, contacts_);
  for (const StepContact& contact : contacts_) {
    ++(contact.kind == ContactKind::vertex_face ? step_.contacts_vf : step_.contacts_ee);
  }
}

void Pipeline::end_step() noexcept try {
  thread_choice_.end_step();
  if (options_.on_contacts && !contacts_.empty()) options_.on_contacts(contacts_);
} catch (const std::exception& error) {
  warnings_.warn_once("on_contacts", std::string("on_contacts threw: ") + error.what());
} catch (...) {
  warnings_.warn_once("on_contacts", "on_contacts threw an exception that is not a std::exception");
}

void Pipeline::debug_draw(btIDebugDraw& drawer, const DebugDrawOptions& options) {
  if (!ran_last_step_) return;
  bullet::debug_draw(contacts_, topology(), motion(), responded_ ? &response_ : nullptr, options,
                     drawer);
}

bool Pipeline::is_moved(std::int32_t vertex) const {
  return responded_ && (untangling_.is_pushed(vertex) || touching_.has_moved(vertex) ||
                        !motion().velocity_change[vertex].isZero() ||
                        motion().solved[vertex] != motion().predicted[vertex] ||
                        !motion().split_displacement[vertex].isZero());
}

std::vector<const btSoftBody*> Pipeline::moved_apart() const {
  std::vector<const btSoftBody*> bodies;
  if (!untangling_.pushes()) return bodies;
  const std::vector<SoftScene::BodyRecord>& records = scene().bodies();
  for (std::size_t i = 0; i < records.size(); ++i)
    if (untangling_.moves_apart(static_cast<std::int32_t>(i))) bodies.push_back(records[i].body);
  std::sort(bodies.begin(), bodies.end());
  return bodies;
}

void Pipeline::wake_moved() const {
  for (const SoftScene::BodyRecord& record : scene().bodies()) {
    if (record.body->isActive()) continue;
    for (std::int32_t v = 0; v < record.vertex_count; ++v) {
      if (!is_moved(record.first_vertex + v)) continue;
      record.body->activate(true);
      break;
    }
  }
}

void Pipeline::hold_stopped_obstacles() {
  if (!responded_) return;
  for (const StepTopology::BodyRecord& body : topology().bodies()) {
    if (body.soft || body.dynamic) continue;
    const RigidMotion& rigid = motion().rigid_of(topology().index_of(body));
    if (rigid.end == rigid.predicted && !motion().is_held(rigid)) continue;
    reader_.hold_at_start(*body.object);
    warnings_.warn_once(
        "squeezed",
        "nodes or bodies are squeezed between bodies of infinite mass that close in on "
        "each other; they stay where they were, and a body that moves on overlaps them "
        "until there is room");
  }
}

std::string Pipeline::status() const {
  std::string text = "LazyCCD: " + detector_.status() + ", " +
                     std::to_string(scene().bodies().size()) + " soft bodies, " +
                     std::to_string(total_.steps) + " steps, " +
                     std::to_string(total_.failsafe_holds) + " fail-safe holds\n";
  return text + warnings_.text();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
