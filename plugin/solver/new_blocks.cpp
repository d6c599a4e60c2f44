// Adding rows to the problem of the contact solver: a stage of blocks of neighbours, their
// vertices, and what they share.
#include <algorithm>
#include <boost/sort/spreadsort/integer_sort.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "settings.h"
#include "solver/contact_solver_parts.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// ContactSolver::NewBlocks::bond() of rows that move a multibody.
constexpr int multibodies = std::numeric_limits<int>::max();

// What node_of_ holds while blocks claim vertices: the claim of a block, which is smaller for
// earlier blocks; then a mark of those that have been collected.
constexpr std::int32_t claim_of(std::int32_t block) {
  return std::numeric_limits<std::int32_t>::min() + block;
}
constexpr std::int32_t collected = -1;

// Rows that a thread takes at a time when it looks where they are.
constexpr std::size_t grain = 1024;

// A Morton code (Morton 1966) orders rows along a curve through the cells of a cube, so that
// neighbours on the curve are near each other.
constexpr int bits_per_axis = settings::solver::morton_bits_per_axis;

// Moves the bits of a coordinate three places apart.
std::uint64_t spread(std::uint32_t coordinate) {
  std::uint64_t spread = 0;
  for (int bit = 0; bit < bits_per_axis; ++bit)
    spread |= static_cast<std::uint64_t>(coordinate >> bit & 1) << (3 * bit);
  return spread;
}

}  // namespace

std::size_t ContactSolver::NewBlocks::start() {
  first_ = s_.block_count_;
  if (rows_.empty()) return 0;
  pieces_.clear();
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    if (!needs_order(parts_[part])) continue;
    for (std::size_t first = parts_[part].first; first < parts_[part].last; first += grain)
      pieces_.push_back({part, first, std::min(first + grain, parts_[part].last)});
  }
  if (pieces_.empty()) return begin_blocks();
  keys_.resize(rows_.size());
  boxes_.resize(pieces_.size());
  phase_ = Phase::measure;
  return pieces_.size();
}

void ContactSolver::NewBlocks::run(std::size_t item, int worker) {
  const std::size_t b = first_ + item;
  switch (phase_) {
    case Phase::measure:
      return measure(item);
    case Phase::find_places:
      return find_places(item);
    case Phase::claim:
      return claim(item);
    case Phase::collect:
      return collect(item);
    case Phase::number:
      return number(s_.blocks_[b]);
    case Phase::find_slots:
      return find_slots(s_.blocks_[b], s_.scratch_[static_cast<std::size_t>(worker)].copy_of);
    case Phase::find_shared:
      return find_shared(s_.blocks_[b]);
    case Phase::fill:
      return s_.fill(s_.blocks_[b], s_.scratch_[static_cast<std::size_t>(worker)]);
  }
}

std::size_t ContactSolver::NewBlocks::next() {
  switch (phase_) {
    case Phase::measure:
      part_boxes_.assign(parts_.size(), {});
      for (std::size_t i = 0; i < pieces_.size(); ++i)
        part_boxes_[pieces_[i].part].extend(boxes_[i]);
      phase_ = Phase::find_places;
      return pieces_.size();
    case Phase::find_places:
      for (const RowsByIsland::Part& part : parts_) {
        if (!needs_order(part)) continue;
        const auto keys = keys_.begin();
        boost::sort::spreadsort::integer_sort(keys + static_cast<std::ptrdiff_t>(part.first),
                                              keys + static_cast<std::ptrdiff_t>(part.last));
        for (std::size_t i = part.first; i < part.last; ++i)
          rows_[i] = static_cast<std::int32_t>(keys_[i] & 0xffffffff);
      }
      return begin_blocks();
    case Phase::claim:
      return begin(Phase::collect);
    case Phase::collect:
      number_vertices();
      return begin(Phase::number);
    case Phase::number:
      s_.sharers_.assign(s_.displacement_.size(), 0);
      for (Scratch& scratch : s_.scratch_) scratch.copy_of.resize(s_.displacement_.size(), 0);
      return begin(Phase::find_slots);
    case Phase::find_slots:
      return begin(Phase::find_shared);
    case Phase::find_shared:
      for (std::size_t b = first_; b < s_.block_count_; ++b)
        for (const std::int32_t row : s_.blocks_[b].new_rows) s_.rows_->place(row);
      make_copies();
      return begin(Phase::fill);
    case Phase::fill:
      break;
  }
  return 0;
}

std::size_t ContactSolver::NewBlocks::begin_blocks() {
  for (const RowsByIsland::Part& part : parts_) {
    for (std::size_t first = part.first; first < part.last;) {
      std::size_t last = std::min(first + block_size(part), part.last);
      if (s_.has_rigid_terms_) {
        for (; last < part.last; ++last) {
          const int kept = bond(rows_[last]);
          if (kept < 0 || kept != bond(rows_[last - 1])) break;
        }
      }
      if (s_.blocks_.size() == s_.block_count_) s_.blocks_.emplace_back();
      RowBlock& block = s_.blocks_[s_.block_count_++];
      block.island = part.island;
      const auto begin = rows_.begin();
      block.rows.assign(begin + static_cast<std::ptrdiff_t>(first),
                        begin + static_cast<std::ptrdiff_t>(last));
      s_.block_row_count_ += block.rows.size();
      first = last;
    }
  }
  if (s_.stages_.size() == s_.stage_count_) s_.stages_.emplace_back();
  Stage& stage = s_.stages_[s_.stage_count_++];
  stage.first = first_;
  stage.last = s_.block_count_;
  return begin(Phase::claim);
}

double ContactSolver::NewBlocks::normal_mass(std::int32_t row) const {
  return s_.rows_->is_made(row) ? (*s_.rows_)[row].normal_mass
                                : s_.rows_->estimate(row).normal_mass;
}

double ContactSolver::NewBlocks::share(const RigidTerm& term, double normal_mass) const {
  const RigidMotion& rigid = s_.motion_->rigid()[term.body];
  return normal_mass * (term.weight * term.weight * rigid.inverse_mass.maxCoeff() +
                        term.arm.squaredNorm() * rigid.inverse_inertia.trace());
}

int ContactSolver::NewBlocks::bond(std::int32_t row) const {
  const Contact& contact = s_.rows_->contact(row);
  const double mass = normal_mass(row);
  int light = -1;
  for (const RigidTerm& term : RigidTerms(contact, contact.weights(), *s_.motion_)) {
    if (s_.motion_->rigid()[term.body].articulated >= 0) return multibodies;
    if (light < 0 && share(term, mass) > settings::solver::max_body_share) light = term.body;
  }
  return light;
}

Vector3d ContactSolver::NewBlocks::place_of(std::int32_t row) const {
  return s_.motion_->start_of(s_.rows_->contact(static_cast<std::size_t>(row)).vertices[0]);
}

void ContactSolver::NewBlocks::measure(std::size_t item) {
  Box box;
  for (std::size_t i = pieces_[item].first; i < pieces_[item].last; ++i)
    box.extend(place_of(rows_[i]));
  boxes_[item] = box;
}

void ContactSolver::NewBlocks::find_places(std::size_t item) {
  const Box& box = part_boxes_[pieces_[item].part];
  const double cells = std::ldexp(1.0, bits_per_axis) - 1;
  const double extent = box.diagonal().maxCoeff(), scale = extent > 0 ? cells / extent : 0;
  for (std::size_t i = pieces_[item].first; i < pieces_[item].last; ++i) {
    const int kept = s_.has_rigid_terms_ ? bond(rows_[i]) : -1;
    std::uint64_t code = 0;
    if (kept != multibodies) {
      const Vector3d place = kept < 0 ? place_of(rows_[i]) : s_.motion_->rigid()[kept].centre();
      const Vector3d at = scale * (place - box.min());
      for (int k = 0; k < 3; ++k)
        code |= spread(static_cast<std::uint32_t>(std::clamp(at[k], 0.0, cells))) << k;
      ++code;
    }
    keys_[i] = code << 32 | static_cast<std::uint32_t>(rows_[i]);
  }
}

void ContactSolver::NewBlocks::claim(std::size_t item) {
  const std::size_t b = first_ + item;
  RowBlock& block = s_.blocks_[b];
  block.new_rows.clear();
  block.bodies.clear();
  block.vertices.clear();
  for (const std::int32_t i : block.rows) {
    s_.rows_->set_may_need_split(static_cast<std::size_t>(i), true);
    if (!s_.rows_->is_made(i)) block.new_rows.push_back(i);
    const Contact& contact = s_.rows_->contact(i);
    const std::array<double, 4> weights = contact.weights();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = contact.vertices[k];
      if (weights[k] * s_.motion_->inverse_mass_of(v) != 0) block.vertices.push_back(v);
    }
    if (s_.has_rigid_terms_) find_bodies(block, i);
  }
  const std::int32_t mark = claim_of(static_cast<std::int32_t>(b));
  for (const std::int32_t v : block.vertices) {
    std::int32_t& node = s_.node_of_[v];
    // Relaxed: the end of the phase orders the claims. The smallest one wins.
    std::int32_t now = __atomic_load_n(&node, __ATOMIC_RELAXED);
    while (
        (now == 0 || s_.is_unclaimed(now) || (now < 0 && now > mark)) &&
        !__atomic_compare_exchange_n(&node, &now, mark, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
  }
}

void ContactSolver::NewBlocks::find_bodies(RowBlock& block, std::int32_t row) const {
  const Contact& contact = s_.rows_->contact(row);
  for (const RigidTerm& term : RigidTerms(contact, contact.weights(), *s_.motion_)) {
    if (s_.motion_->rigid()[term.body].articulated >= 0) continue;
    if (std::find(block.bodies.begin(), block.bodies.end(), term.body) == block.bodies.end())
      block.bodies.push_back(term.body);
  }
}

void ContactSolver::NewBlocks::collect(std::size_t item) {
  RowBlock& block = s_.blocks_[first_ + item];
  const std::int32_t mark = claim_of(static_cast<std::int32_t>(first_ + item));
  block.new_vertices.clear();
  for (const std::int32_t v : block.vertices) {
    // Relaxed: only this block changes its own claims, and others look for theirs.
    if (__atomic_load_n(&s_.node_of_[v], __ATOMIC_RELAXED) != mark) continue;
    __atomic_store_n(&s_.node_of_[v], collected, __ATOMIC_RELAXED);
    block.new_vertices.push_back(v);
  }
}

void ContactSolver::NewBlocks::number_vertices() {
  std::int32_t next = s_.displacement_count();
  for (std::size_t b = first_; b < s_.block_count_; ++b) {
    RowBlock& block = s_.blocks_[b];
    block.first_new_slot = next;
    next += static_cast<std::int32_t>(block.new_vertices.size());
  }
  s_.displacement_.resize(static_cast<std::size_t>(next));
  s_.vertex_of_.resize(static_cast<std::size_t>(next), -1);
}

void ContactSolver::NewBlocks::number(const RowBlock& block) {
  std::int32_t slot = block.first_new_slot;
  for (const std::int32_t v : block.new_vertices) {
    s_.vertex_of_[slot] = v;
    s_.displacement_[slot] = s_.link_displacement(v, s_.problems_[block.island]);
    s_.node_of_[v] = slot++;
  }
}

void ContactSolver::NewBlocks::find_slots(RowBlock& block, Indices& seen) {
  block.slots.clear();
  const auto add = [&](std::int32_t slot) {
    if (seen[slot] != 0) return;
    seen[slot] = 1;
    block.slots.push_back(slot);
  };
  for (const std::int32_t v : block.vertices) add(s_.node_of_[v]);
  for (const std::int32_t body : block.bodies) {
    add(translation_slot(body));
    add(translation_slot(body) + 1);
  }
  for (const std::int32_t slot : block.slots) {
    seen[slot] = 0;
    // Relaxed: the end of the phase orders what comes after.
    __atomic_fetch_add(&s_.sharers_[slot], 1, __ATOMIC_RELAXED);
  }
}

void ContactSolver::NewBlocks::find_shared(RowBlock& block) const {
  block.shared.clear();
  for (const std::int32_t slot : block.slots)
    if (s_.sharers_[slot] > 1) block.shared.push_back(slot);
}

// Gives the body, which is held at its supports, a coupling of its own that moves it `split` times
// as far.
void ContactSolver::NewBlocks::split_coupling(RowBody& body, float split) {
  RowCoupling coupling = s_.couplings_[body.held];
  for (int k = 0; k < 6; ++k) {
    for (float& x : coupling.translation_by[k]) x *= split;
    for (float& x : coupling.rotation_by[k]) x *= split;
  }
  body.held = static_cast<std::int32_t>(s_.couplings_.size());
  s_.couplings_.push_back(coupling);
}

void ContactSolver::NewBlocks::make_copies() {
  const std::size_t slot_count = s_.displacement_.size();
  std::size_t next = slot_count;
  for (std::size_t b = first_; b < s_.block_count_; ++b) {
    s_.blocks_[b].first_own = static_cast<std::int32_t>(next);
    next += s_.blocks_[b].own_count();
  }
  s_.displacement_.resize(next);
  s_.vertex_of_.resize(next, -1);
  s_.slot_scratch_.resize(slot_count, 0);
  SharedSlots& shared = s_.stages_[s_.stage_count_ - 1].shared;
  shared.build({s_.blocks_.data() + first_, s_.block_count_ - first_}, s_.slot_scratch_);
  if (!s_.has_rigid_terms_) return;
  std::iota(s_.row_body_of_.begin(), s_.row_body_of_.end(), 0);
  for (std::size_t rigid = 0; rigid < s_.row_body_of_.size(); ++rigid) {
    const auto split =
        static_cast<float>(s_.sharers_[translation_slot(static_cast<std::int32_t>(rigid))]);
    if (split < 2) continue;
    RowBody body = s_.bodies_[rigid];
    for (float& x : body.inverse_mass) x *= split;
    for (auto& column : body.inverse_inertia)
      for (float& x : column) x *= split;
    if (body.held >= 0) split_coupling(body, split);
    s_.row_body_of_[rigid] = static_cast<std::int32_t>(s_.bodies_.size());
    s_.bodies_.push_back(body);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
