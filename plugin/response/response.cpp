#include "response/response.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"
#include "response/crowding.h"
#include "response/islands.h"
#include "response/rest_damping.h"
#include "response/restitution.h"
#include "response/support_loads.h"
#include "response/velocities.h"
#include "settings.h"
#include "util/profile.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// In the selected islands, motors that do not fit to the last solution give way.
void let_motors_give_way(const RowIslands& islands, Motion& motion) {
  for (ArticulatedMotion& body : motion.articulated) {
    const std::int32_t island = islands.of_rigid(body.links.front().rigid);
    if (island >= 0 && islands.is_selected(island))
      body.update_holds(ArticulatedMotion::Update::weaken_motors);
  }
}

bool are_disjoint(Span<const Island> islands, const Motion& motion) {
  ScratchVector<char> is_in(motion.rigid_of_body().size(), 0);
  for (const Island& island : islands)
    for (const std::int32_t body : island.bodies)
      if (is_in[body]++ != 0) return false;
  return true;
}

bool touches_at_start(const Contact& contact) { return contact.toi == 0; }

}  // namespace

void Response::begin_step(double dt) {
  constraints_.begin_step();
  link_rounds_.begin_step(dt);
}

void Response::renumber(const Renumbering& numbers) {
  constraints_.renumber(numbers);
  link_rounds_.renumber(numbers);
}

void Response::forget() {
  constraints_.forget();
  link_rounds_.forget();
}

void Response::run(const NearContacts& near, const std::vector<Contact>& penetrations,
                   const Detect& detect_all, const LinkSolver& links, Motion& motion,
                   StepStats& stats) {
  constraints_.clear_rows();
  zones_.reset();
  motion.begin_response();
  hold_at_supports(near, motion);
  link_rounds_.clear_bodies();
  if (options_.max_impulse_rounds > 0) {
    solve_speculative(near, penetrations, links, motion);
    if (links) {
      link_rounds_.run(links, options_.solver_iterations, constraints_, motion);
      strain_limit_.hold(link_rounds_.bodies(), links, options_.solver_iterations, constraints_,
                         motion);
      weaken_motors(motion);
    }
  }
  std::vector<Contact> contacts = detect_all(motion.starts(), motion.ends());
  LAZYCCD_ASSERT(are_of(contacts, motion), "contacts are of bodies and vertices of the motion");

  // Initial contacts: pairs that touch before anything moves, such as the two edges of a cut, or
  // bodies that TouchingStarts had no room to part. These pairs touch at the start, so shortening
  // the motion does not help. Between two bodies the relative motion shows the side: the body came
  // from the side opposite to its motion. Such contacts get one solve. Within one body they are
  // ignored.
  std::vector<Contact> initial_contacts;
  if (std::any_of(contacts.begin(), contacts.end(), touches_at_start)) {
    initial_contacts = detect_all(motion.starts(), motion.starts());
    LAZYCCD_ASSERT(are_sorted(initial_contacts), "contacts at the start are sorted, none twice");
  }
  const auto is_initial_contact = [&initial_contacts](const Contact& contact) {
    return touches_at_start(contact) &&
           std::binary_search(initial_contacts.begin(), initial_contacts.end(), contact);
  };
  const Detect detect = [&](const Positions& start, const Positions& end) {
    std::vector<Contact> found = detect_all(start, end);
    found.erase(std::remove_if(found.begin(), found.end(), is_initial_contact), found.end());
    return found;
  };
  stats.initial_contacts += std::count_if(contacts.begin(), contacts.end(), is_initial_contact);
  const auto may_separate_freely = [&](const Contact& contact) {
    return contact.body_a == contact.body_b && is_initial_contact(contact);
  };
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(), may_separate_freely),
                 contacts.end());

  Crowding crowding(motion.rigid_of_body().size());
  for (int i = 0; i < options_.max_impulse_rounds && !contacts.empty(); ++i) {
    if (!constraints_.add(contacts, motion)) break;
    RowIslands& islands = constraints_.islands(motion);
    crowding.add_round(contacts, islands);
    if (!crowding.select_others(contacts, islands)) break;
    if (i >= settings::rounds::solves_with_full_gaps)
      constraints_.narrow_gaps(
          std::max(settings::rounds::min_gap_fraction,
                   std::ldexp(1, settings::rounds::solves_with_full_gaps - 1 - i)),
          motion);
    motion.find_turn_displacement();
    let_motors_give_way(islands, motion);
    constraints_.solve(motion, options_.solver_iterations);
    // What was not near before may have stretched links anew. Later rounds add no rows of links.
    if (links && i == 0 && strain_limit_.is_on()) hold_links_in_contact(links, motion);
    contacts = detect(motion.starts(), motion.ends());
  }
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(), is_initial_contact),
                 contacts.end());
  if (!contacts.empty()) resolve_with_impact_zones(std::move(contacts), detect, motion, stats);
  finish(motion, stats);
}

void Response::hold_links_in_contact(const LinkSolver& links, Motion& motion) {
  const RowIslands& islands = constraints_.islands(motion);
  ScratchVector<char> is_in_contact(motion.rigid_of_body().size(), 0);
  for (const ContactRow* const row : constraints_.active_rows())
    for (const std::int32_t body : {row->contact.body_a, row->contact.body_b})
      is_in_contact[body] = motion.rigid_of_body()[body] < 0 && islands.of_body(body) >= 0 &&
                            islands.is_selected(static_cast<std::size_t>(islands.of_body(body)));
  ScratchVector<std::int32_t> bodies;
  for (std::size_t body = 0; body < is_in_contact.size(); ++body)
    if (is_in_contact[body]) bodies.push_back(static_cast<std::int32_t>(body));
  strain_limit_.hold(bodies, links, options_.solver_iterations, constraints_, motion);
}

void Response::resolve_with_impact_zones(std::vector<Contact> contacts, const Detect& detect,
                                         Motion& motion, StepStats& stats) {
  LAZYCCD_BT_PROFILE("zones");
  ImpactZones& zones = zones_.emplace(motion, threads_);
  std::ptrdiff_t unresolvable = 0;
  const auto detect_again = [&] {
    contacts = detect(motion.starts(), motion.ends());
    const auto last = std::remove_if(contacts.begin(), contacts.end(), [&](const Contact& contact) {
      return zones.is_unresolvable(contact, motion);
    });
    unresolvable = contacts.end() - last;
    contacts.erase(last, contacts.end());
  };
  for (int i = 0; i < options_.max_zone_rounds && !contacts.empty(); ++i) {
    constraints_.add(contacts, motion);
    if (!zones.absorb(contacts, motion)) break;
    detect_again();
  }
  for (int i = 0; !contacts.empty(); ++i) {
    constraints_.add(contacts, motion);
    if (!zones.hold(contacts, i >= settings::rounds::max_node_holds, motion) &&
        !zones.stop_prescribed(contacts, motion)) {
      break;
    }
    detect_again();
  }
  stats.impact_zone_nodes += zones.node_count();
  stats.failsafe_holds += zones.held_count();
  stats.unresolved += unresolvable + static_cast<std::int64_t>(contacts.size());
}

void Response::solve_speculative(const NearContacts& near, const std::vector<Contact>& penetrations,
                                 const LinkSolver& links, Motion& motion) {
  constraints_.take_near_contacts(near, motion);
  if (!penetrations.empty())
    constraints_.add_penetrations(penetrations, options_.untangling_speed, motion);
  strain_limit_.warm_start(near, links, constraints_, motion);
  constraints_.warm_start();
  leave_supports(constraints_.loaded_rows(), motion);  // as in the last step, if at all
  constraints_.solve(motion, options_.solver_iterations);
  let_bodies_leave_supports(motion);
  hold_joints(motion);
  set_velocities(threads_, motion);
  RowIslands& islands = constraints_.islands(motion);
  if (!select_with_energy_gain(motion, islands)) return;
  constraints_.cold_start(motion);
  constraints_.solve(motion, options_.solver_iterations);
  hold_joints(motion);
}

void Response::let_bodies_leave_supports(Motion& motion) {
  const ScratchVector<int> left = leave_supports(constraints_.loaded_rows(), motion);
  if (left.empty()) return;
  RowIslands& islands = constraints_.islands(motion);
  islands.select_none();
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(motion.rigid_of_body().size());
       ++body)
    if (std::binary_search(left.begin(), left.end(), motion.rigid_of_body()[body]))
      islands.select_body(body);
  constraints_.solve(motion, options_.solver_iterations);
}

bool Response::update_holds(const UpdateHolds& update, Motion& motion) {
  ScratchVector<char> is_changed(motion.articulated.size()), is_beyond(motion.articulated.size());
  for (std::size_t a = 0; a < is_changed.size(); ++a) {
    const ArticulatedMotion::Changes changes = update(motion.articulated[a]);
    is_changed[a] = changes.any;
    is_beyond[a] = changes.any_beyond;
  }
  const auto select = [&](const ScratchVector<char>& of) {
    if (std::find(of.begin(), of.end(), 1) == of.end()) return false;
    RowIslands& islands = constraints_.islands(motion);
    islands.select_none();
    for (std::size_t body = 0; body < motion.rigid_of_body().size(); ++body) {
      const std::int32_t rigid = motion.rigid_of_body()[body];
      const int articulated = rigid < 0 ? -1 : motion.rigid()[rigid].articulated;
      if (articulated >= 0 && of[static_cast<std::size_t>(articulated)])
        islands.select_body(static_cast<std::int32_t>(body));
    }
    return true;
  };
  // Impulses between what leaves no room to each other are of no use.
  if (select(is_beyond)) constraints_.cold_start(motion);
  if (!select(is_changed)) return false;
  constraints_.solve(motion, options_.solver_iterations);
  return true;
}

void Response::hold_joints(Motion& motion) {
  for (int i = 0; i < settings::joints::max_motor_rounds; ++i) {
    const auto update = [i](ArticulatedMotion& body) {
      const bool any_motor = body.has_motors();
      const int rounds = any_motor ? settings::joints::max_motor_rounds
                                   : settings::joints::max_limit_rounds,
                last_rounds = any_motor ? settings::joints::last_motor_rounds
                                        : settings::joints::last_limit_rounds;
      if (i >= rounds) return ArticulatedMotion::Changes();
      return body.update_holds(i < rounds - last_rounds ? ArticulatedMotion::Update::all
                                                        : ArticulatedMotion::Update::last,
                               i + 1 == rounds);
    };
    if (!update_holds(update, motion)) return;
  }
}

void Response::weaken_motors(Motion& motion) {
  for (int i = 0; i < settings::joints::last_motor_rounds; ++i) {
    const auto update = [i](ArticulatedMotion& body) {
      return body.update_holds(ArticulatedMotion::Update::weaken_motors,
                               i + 1 == settings::joints::last_motor_rounds);
    };
    if (!update_holds(update, motion)) return;
  }
}

void Response::finish(Motion& motion, StepStats& stats) {
  LAZYCCD_BT_PROFILE("velocities");
  const std::vector<const ContactRow*>& active_rows = constraints_.active_rows();
  const RowIslands& row_islands = constraints_.islands(motion);
  stats.contact_rows += static_cast<std::int64_t>(row_islands.row_count());
  stats.islands += static_cast<std::int64_t>(row_islands.count());
  stats.sweeps += constraints_.sweep_count();
  stats.strained_links += constraints_.count_pulling_links();
  set_velocities(threads_, motion);
  if (options_.restitution > 0) {
    add_restitution(constraints_.rows(), options_.restitution, options_.restitution_threshold,
                    options_.solver_iterations, threads_, motion);
  }
  const std::vector<const ContactRow*>& loaded_rows = constraints_.loaded_rows();
  islands_.find(loaded_rows, link_rounds_.bodies(), motion);
  const Span<const Island> islands = islands_.all();
  LAZYCCD_ASSERT(are_disjoint(islands, motion), "islands whose momentum is kept share no body");
  restore_angular_momentum(islands, threads_, motion);
  limit_lever_speeds(islands, threads_, motion);
  limit_kinetic_energy(islands, threads_, motion);
  damp_deformation(active_rows, options_.rest_damping, options_.rest_speed, threads_, motion);
  set_load_velocities(loaded_rows, motion);
  LAZYCCD_ASSERT(std::all_of(motion.velocity_change.begin(), motion.velocity_change.end(),
                             [](const Vector3d& change) { return change.allFinite(); }),
                 "the response changes velocities by finite amounts");
  if (!options_.measure_energy) return;
  const double before = kinetic_energy_before(motion);
  const double change = kinetic_energy_after(motion) - before;
  (change > 0 ? stats.energy_gained : stats.energy_lost) += std::abs(change);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
