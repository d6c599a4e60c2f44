#include "response/contact_constraints.h"

#include <algorithm>
#include <cmath>

#include "contact/contact_checks.h"
#include "contact/rigid_terms.h"
#include "lazyccd/debug/assert.h"
#include "motion/articulated_motion.h"
#include "settings.h"
#include "util/matrix.h"
#include "util/profile.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Whether one side of the contact has infinite mass.
bool has_fixed_side(const Contact& contact, const Motion& motion) {
  const int first_of_b = first_vertex_of_b(contact.kind);
  const auto is_fixed = [&](std::int32_t body, int first, int last) {
    const int rigid = motion.rigid_of_body()[body];
    if (rigid >= 0) return !motion.rigid()[rigid].is_movable();
    return std::none_of(&contact.vertices[first], contact.vertices.data() + last,
                        [&](std::int32_t v) { return motion.is_movable(v); });
  };
  return is_fixed(contact.body_a, 0, first_of_b) || is_fixed(contact.body_b, first_of_b, 4);
}

}  // namespace

Vector3d gap_vector_at_end(const ContactRow& row, const Motion& motion) {
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = row.contact.vertices[i];
    sum += row.weights[i] * (motion.is_free(v) ? motion.solved[v] : motion.end_without_impulses(v));
  }
  for (const RigidTerm& term : RigidTerms(row.contact, row.weights, motion)) {
    const RigidMotion& body = motion.rigid()[term.body];
    sum += term.displacement(body.translation, body.rotation);
  }
  return sum;
}

void ContactConstraints::begin_step() {
  last_impulses_.take(active_rows());
  take_link_impulses();
  clear_rows();
}

void ContactConstraints::clear_rows() {
  rows_.clear();
  has_links_ = false;
  active_rows_are_current_ = false;
  islands_are_current_ = false;
  sweep_count_ = 0;
}

RowIslands& ContactConstraints::islands(const Motion& motion) {
  if (!islands_are_current_) islands_.find(rows_, motion, threads_);
  islands_are_current_ = true;
  return islands_;
}

const std::vector<const ContactRow*>& ContactConstraints::active_rows() {
  if (active_rows_are_current_) return active_rows_;
  constexpr std::size_t grain = 4096;
  // Rows of a pair are adjacent. A part begins with a pair.
  const auto begin_of_part = [this](std::size_t i) {
    i = std::min(i, rows_.size());
    while (i > 0 && i < rows_.size() && !(rows_.contact(i - 1) < rows_.contact(i))) ++i;
    return i;
  };
  std::vector<std::vector<const ContactRow*>>& parts = active_parts_;
  parts.resize((rows_.size() + grain - 1) / grain);
  threads_.parallel_for(parts.size(), 1, [&](std::size_t first_part, std::size_t last_part) {
    for (std::size_t part = first_part; part < last_part; ++part)
      find_active_rows(begin_of_part(part * grain), begin_of_part((part + 1) * grain), parts[part]);
  });
  active_rows_.clear();
  for (const auto& part : parts) active_rows_.insert(active_rows_.end(), part.begin(), part.end());
  LAZYCCD_ASSERT(are_in_order(active_rows_), "rows that acted are in the order of their contacts");
  active_rows_are_current_ = true;
  return active_rows_;
}

void ContactConstraints::find_active_rows(std::size_t first, std::size_t last,
                                          std::vector<const ContactRow*>& found) const {
  const auto is_same_pair = [this](std::size_t i, std::size_t j) {
    return rows_.is_made(i) && rows_.is_made(j) && !(rows_.made(i).contact < rows_.made(j).contact);
  };
  found.clear();
  std::size_t next = first;  // first row after those of the last pair
  for (std::size_t i = first; i < last; ++i) {
    if (!rows_.is_made(i) || !rows_.made(i).acted() || is_of_link(rows_.contact(i))) continue;
    std::size_t begin = i;
    while (begin > next && is_same_pair(begin - 1, i)) --begin;
    for (next = begin; next <= i || (next < last && is_same_pair(i, next)); ++next)
      found.push_back(&rows_.made(next));
    i = next - 1;
  }
}

void ContactConstraints::renumber(const Renumbering& numbers) {
  clear_rows();
  last_impulses_.renumber(numbers);
  const auto renumbered = [&numbers](LastLinkImpulse& last) {
    last.body = numbers.bodies[static_cast<std::size_t>(last.body)];
    for (std::int32_t& v : last.vertices) v = numbers.vertices[static_cast<std::size_t>(v)];
    return last.body >= 0 && last.vertices[0] >= 0 && last.vertices[1] >= 0;
  };
  const auto is_gone = [&](LastLinkImpulse& last) { return !renumbered(last); };
  last_link_impulses_.erase(
      std::remove_if(last_link_impulses_.begin(), last_link_impulses_.end(), is_gone),
      last_link_impulses_.end());
  std::stable_sort(
      last_link_impulses_.begin(), last_link_impulses_.end(),
      [](const LastLinkImpulse& x, const LastLinkImpulse& y) { return x.body < y.body; });
}

void ContactConstraints::forget() {
  clear_rows();
  last_impulses_.clear();
  last_link_impulses_.clear();
}

void ContactConstraints::take_near_contacts(const NearContacts& near, const Motion& motion) {
  active_rows_are_current_ = false;
  islands_are_current_ = false;
  rows_.take(near, RowFactory(surfaces_, position_correction_, motion));
}

void ContactConstraints::warm_start() {
  active_rows_are_current_ = false;
  if (last_impulses_.needs_match()) return;  // nothing was near
  const std::vector<LastImpulses::Pair>& pairs = last_impulses_.pairs();
  constexpr std::size_t grain = 512;
  std::vector<std::vector<WarmStart>>& parts = warm_starts_;
  parts.resize((pairs.size() + grain - 1) / grain);
  const auto for_each_part = [&](const auto& each) {
    threads_.parallel_for(parts.size(), 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t part = first; part < last; ++part) each(part);
    });
  };
  for_each_part([&](std::size_t part) {
    const std::size_t end = std::min((part + 1) * grain, pairs.size());
    parts[part].clear();
    std::size_t row = 0;  // where the search for the next pair begins
    for (std::size_t i = part * grain; i < end; ++i) {
      const LastImpulses::Pair& last = pairs[i];
      row = rows_.find(last.contact, row);
      for (; row < rows_.size() && !(last.contact < rows_.contact(row)); ++row)
        if (rows_.can_act(row)) parts[part].push_back({row, &last, rows_.is_made(row)});
    }
  });
  for (const std::vector<WarmStart>& part : parts) {
    for (const WarmStart& start : part)
      if (!start.is_made) rows_.place(start.row);
  }
  for_each_part([&](std::size_t part) {
    for (const WarmStart& start : parts[part]) {
      if (!start.is_made) rows_.make_placed(start.row);
      ContactRow& row = rows_[start.row];
      row.loaded_gap = std::max(row.loaded_gap, start.last->gap);
      row.normal_impulse = std::max(0.0, row.normal.dot(start.last->impulse));
      row.tangent_impulse = start.last->impulse - row.normal.dot(start.last->impulse) * row.normal;
      const double max_tangent = row.friction * row.normal_impulse,
                   size = row.tangent_impulse.norm();
      if (size > max_tangent && row.sliding_fraction == 0)
        row.tangent_impulse *= max_tangent / size;
    }
  });
}

void ContactConstraints::cold_start(Motion& motion) {
  active_rows_are_current_ = false;
  const RowIslands& all = islands(motion);
  for (std::size_t island = 0; island < all.count(); ++island) {
    if (!all.is_selected(island)) continue;
    for (const std::int32_t i : all.rows_of(island)) {
      if (!rows_.is_made(i)) continue;
      rows_[i].normal_impulse = rows_[i].split_impulse = 0;
      rows_[i].tangent_impulse.setZero();
    }
  }
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(motion.rigid_of_body().size());
       ++body) {
    if (all.of_body(body) >= 0 && all.is_selected(all.of_body(body))) motion.restart_response(body);
  }
}

template <class Make>
void ContactConstraints::add_rows(Span<const Contact> contacts, const Motion& motion,
                                  const Make& make) {
  active_rows_are_current_ = false;
  islands_are_current_ = false;
  rows_.add(contacts, [&](const Contact& contact, ContactRow& row) {
    make(contact, row);
    LAZYCCD_ASSERT(start_satisfies(row, motion), "the start of the step satisfies an added row");
  });
}

bool ContactConstraints::add(const std::vector<Contact>& contacts, const Motion& motion) {
  LAZYCCD_ASSERT(are_sorted(contacts), "contacts that become rows are sorted, none twice");
  const RowFactory factory(surfaces_, position_correction_, motion);
  bool any_can_act = false;
  add_rows(contacts, motion, [&](const Contact& contact, ContactRow& row) {
    factory.make(contact, row);
    row.touched = true;
    any_can_act = any_can_act || row.can_act;
  });
  return any_can_act;
}

void ContactConstraints::add_penetrations(const std::vector<Contact>& contacts, double speed,
                                          const Motion& motion) {
  const RowFactory factory(surfaces_, position_correction_, motion);
  add_rows(contacts, motion, [&](const Contact& contact, ContactRow& row) {
    factory.make(contact, row);
    const double depth = std::max(0.0, -row.start_gap);
    const double distance = std::max(speed, settings::untangling::exit_rate * depth) * motion.dt();
    const double outside = surfaces_.of(contact.body_a, contact.body_b).resolution;
    factory.make_penetration(contact, std::min(distance, depth + outside), row);
  });
}

void ContactConstraints::add_links(Span<const LinkLimit> links, const Motion& motion) {
  if (links.empty()) return;
  has_links_ = true;
  ScratchVector<Contact> contacts(links.size());
  std::transform(links.begin(), links.end(), contacts.begin(), contact_of);
  const RowFactory factory(surfaces_, position_correction_, motion);
  auto next = links.begin();
  add_rows(contacts, motion,
           [&](const Contact&, ContactRow& row) { factory.make_link(*next++, row); });
}

template <class Visit>
void ContactConstraints::for_each_pulling_link(const Visit& visit) const {
  for (std::size_t i = 0; has_links_ && i < rows_.size(); ++i)
    if (rows_.is_made(i) && is_of_link(rows_.contact(i)) && rows_.made(i).normal_impulse > 0)
      visit(rows_.made(i));
}

void ContactConstraints::take_link_impulses() {
  last_link_impulses_.clear();
  for_each_pulling_link([this](const ContactRow& row) {
    const Contact& contact = row.contact;
    const std::int32_t body = contact.body_a, link = link_of(contact);
    if (last_link_impulses_.empty() || last_link_impulses_.back().body != body ||
        last_link_impulses_.back().link != link)
      last_link_impulses_.push_back(
          {body, link, {contact.vertices[0], contact.vertices[2]}, Vector3d::Zero()});
    last_link_impulses_.back().impulse -= row.normal_impulse * row.normal;
  });
}

std::int64_t ContactConstraints::count_pulling_links() const {
  std::int64_t count = 0;
  const Contact* last = nullptr;  // a link may have several rows, one after the other
  for_each_pulling_link([&](const ContactRow& row) {
    count += !last || *last < row.contact;
    last = &row.contact;
  });
  return count;
}

const std::vector<const ContactRow*>& ContactConstraints::loaded_rows() {
  if (!has_links_) return active_rows();
  loaded_rows_ = active_rows();
  for_each_pulling_link([this](const ContactRow& row) { loaded_rows_.push_back(&row); });
  return loaded_rows_;
}

void ContactConstraints::narrow_gaps(double fraction, const Motion& motion) {
  const ScratchVector<char> moves = find_prescribed_motion(motion);
  const RowIslands& all = islands(motion);
  for (std::size_t island = 0; island < all.count(); ++island) {
    if (!all.is_selected(island) || !moves[island]) continue;
    for (const std::int32_t i : all.rows_of(island)) narrow_gap(rows_[i], fraction, motion);
  }
}

ScratchVector<char> ContactConstraints::find_prescribed_motion(const Motion& motion) {
  ScratchVector<char> body_moves(motion.rigid_of_body().size());
  for (std::size_t body = 0; body < body_moves.size(); ++body)
    body_moves[body] = motion.has_prescribed_motion(static_cast<std::int32_t>(body));
  const RowIslands& all = islands(motion);
  ScratchVector<char> moves(all.count(), 0);
  for (std::size_t island = 0; island < all.count(); ++island) {
    const Span<const std::int32_t> rows = all.rows_of(island);
    moves[island] = std::any_of(rows.begin(), rows.end(), [&](std::int32_t row) {
      const Contact& contact = rows_.contact(static_cast<std::size_t>(row));
      return body_moves[contact.body_a] || body_moves[contact.body_b];
    });
  }
  return moves;
}

void ContactConstraints::narrow_gap(ContactRow& row, double fraction, const Motion& motion) {
  if (!has_fixed_side(row.contact, motion) ||
      row.normal.dot(gap_vector_at_end(row, motion)) >=
          settings::rounds::fulfilled_fraction * row.target_gap)
    return;
  const double surface_thickness = surfaces_.of(row.contact.body_a, row.contact.body_b).thickness;
  const double thickness = thickness_of(row.contact, motion, surface_thickness);
  row.target_gap = row.corrected_gap = std::min(row.target_gap, fraction * thickness);
}

void ContactConstraints::solve(Motion& motion, int sweeps) {
  solve_impulses(motion, sweeps, ContactSolver::Manner::full);
  solve_split_impulses(motion, sweeps);
}

void ContactConstraints::solve_impulses(Motion& motion, int sweeps, ContactSolver::Manner manner) {
  LAZYCCD_BT_PROFILE("solve");
  solver_.set_up(rows_, islands(motion), motion, manner);
  solve_set_up(motion, sweeps);
}

void ContactConstraints::solve_impulses_again(Motion& motion, int sweeps) {
  LAZYCCD_BT_PROFILE("solve again");
  solver_.go_on();
  solve_set_up(motion, sweeps);
}

void ContactConstraints::solve_set_up(Motion& motion, int sweeps) {
  active_rows_are_current_ = false;
  sweep_count_ += solver_.solve(sweeps);
  solver_.write(motion);
}

ScratchVector<BodyPair> ContactConstraints::find_pressed_pairs(const Motion& motion) {
  ScratchVector<BodyPair> pressed;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!rows_.is_made(i)) continue;
    const ContactRow& row = rows_.made(i);
    if (is_of_link(row.contact) ||
        !(row.normal_impulse > settings::solver::min_speed * motion.dt() * row.normal_mass))
      continue;
    const BodyPair pair = ordered_bodies(row.contact);
    if (pressed.empty() || pressed.back() != pair) pressed.push_back(pair);
  }
  std::sort(pressed.begin(), pressed.end());
  pressed.erase(std::unique(pressed.begin(), pressed.end()), pressed.end());
  if (pressed.empty()) return pressed;
  const ScratchVector<char> is_driven = find_prescribed_motion(motion);
  const RowIslands& all = islands(motion);
  const auto is_in_driven_island = [&](const BodyPair& pair) {
    const std::int32_t island = std::max(all.of_body(pair[0]), all.of_body(pair[1]));
    return island >= 0 && is_driven[static_cast<std::size_t>(island)];
  };
  pressed.erase(std::remove_if(pressed.begin(), pressed.end(), is_in_driven_island), pressed.end());
  return pressed;
}

void ContactConstraints::solve_split_impulses(Motion& motion, int sweeps) {
  LAZYCCD_BT_PROFILE("solve split impulses");
  active_rows_are_current_ = false;
  const RowIslands& all = islands(motion);
  const ScratchVector<BodyPair> pressed = find_pressed_pairs(motion);
  solver_.mark_violated();
  split_solver_.set_up(rows_, all, motion, ContactSolver::Manner::full, pressed);
  sweep_count_ += split_solver_.solve(sweeps);
  split_solver_.write(motion);
  const auto is_solved = [&all](std::size_t rigid) {
    const std::int32_t island = all.of_rigid(rigid);
    return island >= 0 && all.is_selected(island);
  };
  for (std::size_t i = 0; i < motion.rigid().size(); ++i)
    if (motion.rigid()[i].is_dynamic() && is_solved(i)) motion.apply_response(motion.rigid()[i]);
  for (ArticulatedMotion& body : motion.articulated)
    if (is_solved(body.links.front().rigid)) motion.apply_response(body);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
