#include "response/link_rounds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Again = LinkSolver::Again;

// An impact is what the impulses of the last step do not stop: contacts that still meet faster than
// this, m/s.
constexpr double min_impact_speed = 0.15;
// And the load of the body, the sum of its normal forces, must rise by this factor. Where a body
// rests or slides, single nodes meet that fast in each step, but the load stays as it is.
constexpr double min_load_growth = 1.1;
constexpr int max_rounds_after_impact = 2;
// Under load, links are solved again where contacts move a node by more than this fraction of its
// shortest edge in the step. Where they move nodes less, links have little to correct.
constexpr double min_pushed_fraction = 0.7;
constexpr int max_rounds_under_load = 4;
// Links that move nodes more slowly than this end the rounds, m/s.
constexpr double min_link_speed = 0.25;

// Of these soft bodies, those of which contacts push a node too far.
std::vector<std::int32_t> pushed_far(std::vector<std::int32_t> bodies,
                                     const std::vector<const ContactRow*>& rows,
                                     const Motion& motion) {
  if (bodies.empty()) return bodies;
  std::vector<char> is_pushed(motion.rigid_of_body.size(), 0);
  for (const ContactRow* const row : rows) {
    const Contact& contact = row->contact;
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = contact.vertices[k];
      if (!motion.is_free(v)) continue;
      const double moved = std::abs(row->weights[k]) * motion.inverse_mass[v] * row->normal_impulse;
      if (moved > min_pushed_fraction * motion.shortest_edge[v])
        is_pushed[k < first_vertex_of_b(contact.kind) ? contact.body_a : contact.body_b] = 1;
    }
  }
  const auto is_not = [&is_pushed](std::int32_t body) { return !is_pushed[body]; };
  bodies.erase(std::remove_if(bodies.begin(), bodies.end(), is_not), bodies.end());
  return bodies;
}

}  // namespace

void LinkRounds::begin_step() {
  if (!loads_.empty()) std::swap(loads_, last_loads_);
  loads_.clear();
}

void LinkRounds::renumber(const Renumbering& numbers) {
  const std::vector<double> loads = std::exchange(last_loads_, {});
  for (std::size_t body = 0; body < std::min(loads.size(), numbers.bodies.size()); ++body) {
    const std::int32_t now = numbers.bodies[body];
    if (now < 0) continue;
    if (last_loads_.size() <= static_cast<std::size_t>(now))
      last_loads_.resize(static_cast<std::size_t>(now) + 1, 0);
    last_loads_[now] = loads[body];
  }
}

void LinkRounds::forget() {
  loads_.clear();
  last_loads_.clear();
}

LinkRounds::Bodies LinkRounds::find_rising_loads(const std::vector<const ContactRow*>& rows,
                                                 const Motion& motion) {
  loads_.assign(motion.rigid_of_body.size(), 0);
  for (const ContactRow* const row : rows) {
    for (const std::int32_t body : {row->contact.body_a, row->contact.body_b})
      loads_[body] += row->normal_impulse / (motion.dt * motion.dt);
  }
  Bodies rising;
  for (std::size_t body = 0; body < loads_.size(); ++body) {
    const double before = body < last_loads_.size() ? last_loads_[body] : 0;
    if (motion.rigid_of_body[body] < 0 && loads_[body] > min_load_growth * before)
      rising.push_back(static_cast<std::int32_t>(body));
  }
  return rising;
}

void LinkRounds::run(const LinkSolver& links, int sweeps, ContactConstraints& constraints,
                     Motion& motion) {
  const std::vector<const ContactRow*>& rows = constraints.active_rows();
  Bodies hit, loaded;
  for (const std::int32_t body : find_rising_loads(rows, motion)) {
    if (links.again(body) == Again::after_impact &&
        constraints.approach_of(body) >= min_impact_speed * motion.dt)
      hit.push_back(body);
  }
  for (std::size_t body = 0; body < loads_.size(); ++body) {
    const auto index = static_cast<std::int32_t>(body);
    if (motion.rigid_of_body[body] < 0 && loads_[body] > 0 &&
        links.again(index) == Again::under_load)
      loaded.push_back(index);
  }
  loaded = pushed_far(std::move(loaded), rows, motion);
  bodies_ = hit;
  bodies_.insert(bodies_.end(), loaded.begin(), loaded.end());
  solve_in_turn(loaded, max_rounds_under_load, ContactSolver::Friction::bounded, links, sweeps,
                constraints, motion);
  solve_in_turn(hit, max_rounds_after_impact, ContactSolver::Friction::open, links, sweeps,
                constraints, motion);
}

void LinkRounds::solve_in_turn(const Bodies& bodies, int rounds, ContactSolver::Friction friction,
                               const LinkSolver& links, int sweeps, ContactConstraints& constraints,
                               Motion& motion) {
  std::map<std::int32_t, Bodies> bodies_of;  // by island
  for (const std::int32_t body : bodies)
    bodies_of[constraints.islands(motion).of_body(body)].push_back(body);
  if (bodies_of.empty()) return;
  RowIslands& islands = constraints.islands(motion);
  for (int i = 0; i < rounds && !bodies_of.empty(); ++i) {
    islands.select_none();
    for (auto next = bodies_of.begin(); next != bodies_of.end();) {
      const auto island = next++;
      const double moved = links.solve(island->second, motion);
      if (moved > 0) islands.select_body(island->second.front());
      if (moved < min_link_speed * motion.dt) bodies_of.erase(island);
    }
    constraints.solve_impulses(motion, sweeps, friction);
  }
  islands.select_none();
  for (const std::int32_t body : bodies) islands.select_body(body);
  constraints.solve_split_impulses(motion, sweeps);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
