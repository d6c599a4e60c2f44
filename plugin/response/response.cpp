#include "response/response.h"

#include <algorithm>
#include <cmath>

#include "response/impact_zones.h"
#include "response/islands.h"
#include "response/rest_damping.h"
#include "response/restitution.h"
#include "response/velocities.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// After this many detections that held only what was in contact, whole bodies are held.
constexpr int node_wise_holds = 16;

// Answers after which gaps that cannot all be kept are narrowed, by half each time.
constexpr int answers_in_full = 1;
constexpr double least_part_kept = 1.0 / 16;

// Crowded contacts that so many answers by impulses do not halve are left to impact zones.
constexpr std::size_t answers_to_halve = 4;

bool starts_touching(const Contact& contact) { return contact.toi == 0; }

// More of them than vertices that they have: everything sweeps through everything.
bool are_crowded(const std::vector<Contact>& contacts) {
  constexpr std::size_t few = 100;
  if (contacts.size() < few) return false;
  std::vector<std::int32_t> vertices;
  vertices.reserve(4 * contacts.size());
  for (const Contact& contact : contacts)
    vertices.insert(vertices.end(), contact.vertices.begin(), contact.vertices.end());
  std::sort(vertices.begin(), vertices.end());
  const auto last = std::unique(vertices.begin(), vertices.end());
  return contacts.size() > static_cast<std::size_t>(last - vertices.begin());
}

}  // namespace

void Response::run(const SpeculativePairs& near, const Detect& detect_all, Motion& motion,
                   StepStats& stats) {
  rows_.begin_step();
  motion.begin_response();
  if (options_.max_detections > 0) relax_near(near, motion);
  std::vector<Contact> contacts = detect_all(motion.starts(), motion.ends());

  // Pairs that touch before anything moves (bodies placed so, the lips of a cut) cannot be cleaned
  // by moving less, and have no side yet. Between bodies the motion tells it: they came from where
  // they do not go, and get one answer. Within a body they part freely.
  std::vector<Contact> touching;
  if (std::any_of(contacts.begin(), contacts.end(), starts_touching)) {
    touching = detect_all(motion.starts(), motion.starts());
  }
  const auto touches = [&touching](const Contact& contact) {
    return starts_touching(contact) &&
           std::binary_search(touching.begin(), touching.end(), contact);
  };
  const Detect detect = [&](const Positions& start, const Positions& end) {
    std::vector<Contact> found = detect_all(start, end);
    found.erase(std::remove_if(found.begin(), found.end(), touches), found.end());
    return found;
  };
  stats.initial_contacts += std::count_if(contacts.begin(), contacts.end(), touches);
  const auto parts_freely = [&](const Contact& contact) {
    return contact.body_a == contact.body_b && touches(contact);
  };
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(), parts_freely), contacts.end());

  std::vector<std::size_t> counts;  // of contacts, by answer
  for (int i = 0; i < options_.max_detections && !contacts.empty(); ++i) {
    counts.push_back(contacts.size());
    if (counts.size() > answers_to_halve &&
        2 * counts.back() > counts[counts.size() - 1 - answers_to_halve] && are_crowded(contacts))
      break;
    if (!rows_.add(contacts, motion)) break;
    if (i >= answers_in_full && motion.has_prescribed_motion())
      rows_.narrow(std::max(least_part_kept, std::ldexp(1, answers_in_full - 1 - i)), motion);
    rows_.relax(motion, options_.solver_iterations);
    contacts = detect(motion.starts(), motion.ends());
  }
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(), touches), contacts.end());
  if (!contacts.empty()) end_contacts(std::move(contacts), detect, motion, stats);
  finish(motion, stats);
}

void Response::end_contacts(std::vector<Contact> contacts, const Detect& detect, Motion& motion,
                            StepStats& stats) {
  ImpactZones zones(motion);
  std::ptrdiff_t hopeless = 0;
  const auto detect_again = [&] {
    contacts = detect(motion.starts(), motion.ends());
    const auto last = std::remove_if(contacts.begin(), contacts.end(), [&](const Contact& contact) {
      return zones.is_unresolvable(contact, motion);
    });
    hopeless = contacts.end() - last;
    contacts.erase(last, contacts.end());
  };
  for (int i = 0; i < options_.max_impact_zones && !contacts.empty(); ++i) {
    rows_.add(contacts, motion);
    if (!zones.absorb(contacts, motion)) break;
    detect_again();
  }
  for (int i = 0; !contacts.empty(); ++i) {
    rows_.add(contacts, motion);
    if (!zones.hold(contacts, i >= node_wise_holds, motion) &&
        !zones.stop_prescribed(contacts, motion)) {
      break;
    }
    detect_again();
  }
  stats.impact_zone_nodes += zones.node_count();
  stats.failsafe_holds += zones.held_count();
  stats.unresolved += hopeless + static_cast<std::int64_t>(contacts.size());
}

void Response::relax_near(const SpeculativePairs& near, Motion& motion) {
  rows_.take(near, motion);
  rows_.start_warm();
  rows_.relax(motion, options_.solver_iterations);
  set_velocities(motion);
  if (kinetic_energy_after(motion) <= kinetic_energy_before(motion)) return;
  rows_.start_cold(motion);
  rows_.relax(motion, options_.solver_iterations);
}

void Response::finish(Motion& motion, StepStats& stats) {
  const std::vector<const ContactRow*>& is_active = rows_.is_active();
  set_velocities(motion);
  if (options_.restitution > 0) {
    add_restitution(rows_.rows(), options_.restitution, options_.restitution_threshold,
                    options_.solver_iterations, motion);
  }
  const std::vector<Island> islands = find_islands(is_active, motion);
  restore_angular_momentum(islands, motion);
  limit_kinetic_energy(islands, motion);
  damp_deformation(is_active, options_.rest_damping, options_.rest_speed, motion);
  const double before = kinetic_energy_before(motion);
  const double change = kinetic_energy_after(motion) - before;
  (change > 0 ? stats.energy_gained : stats.energy_lost) += std::abs(change);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
