// Adding rows to the problem of the contact solver: blocks of neighbours, their vertices and
// colours.
#include <algorithm>
#include <boost/sort/spreadsort/integer_sort.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "solver/contact_solver_parts.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Largest growth of a row's compliance where several blocks move a body, as a fraction.
constexpr double max_split_growth = 0.5;
// Most blocks of a colour that move the same body, whatever its mass.
constexpr int max_shared_limit = 1 << 12;

// What node_of_ holds while blocks claim vertices: the claim of a block, which is smaller for
// earlier blocks; then a mark of those that have been collected.
constexpr std::int32_t claim_of(std::int32_t block) {
  return std::numeric_limits<std::int32_t>::min() + block;
}
constexpr std::int32_t collected = -1;

// Rows that a thread takes at a time when it looks where they are.
constexpr std::size_t grain = 1024;

// A Morton code (Morton 1966) orders rows along a curve through the cells of a cube, so that
// neighbours on the curve are near each other. It has this many bits for each axis.
constexpr int bits_per_axis = 10;

// Moves the bits of a coordinate three places apart.
std::uint64_t spread(std::uint32_t coordinate) {
  std::uint64_t spread = 0;
  for (int bit = 0; bit < bits_per_axis; ++bit)
    spread |= static_cast<std::uint64_t>(coordinate >> bit & 1) << (3 * bit);
  return spread;
}

}  // namespace

std::size_t ContactSolver::NewBlocks::start(RowsByIsland rows) {
  first_ = s_.block_count_;
  rows_ = std::move(rows.rows);
  parts_ = std::move(rows.parts);
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
    case Phase::number: {
      std::int32_t slot = s_.blocks_[b].first_new_slot;
      for (const std::int32_t v : s_.blocks_[b].new_vertices) s_.node_of_[v] = slot++;
      return;
    }
    case Phase::find_slots:
      return find_slots(s_.blocks_[b]);
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
      return begin(Phase::find_slots);
    case Phase::find_slots:
      for (std::size_t b = first_; b < s_.block_count_; ++b)
        for (const std::int32_t row : s_.blocks_[b].new_rows) s_.rows_->place(row);
      share_bodies();
      colour();
      return begin(Phase::fill);
    case Phase::fill:
      break;
  }
  return 0;
}

std::size_t ContactSolver::NewBlocks::begin_blocks() {
  for (const RowsByIsland::Part& part : parts_) {
    for (std::size_t first = part.first; first < part.last; first += RowBlock::max_rows) {
      if (s_.blocks_.size() == s_.block_count_) s_.blocks_.emplace_back();
      RowBlock& block = s_.blocks_[s_.block_count_++];
      block.island = part.island;
      const auto begin = rows_.begin() + static_cast<std::ptrdiff_t>(first);
      block.rows.assign(begin, begin + static_cast<std::ptrdiff_t>(
                                           std::min(RowBlock::max_rows, part.last - first)));
    }
  }
  return begin(Phase::claim);
}

Eigen::Vector3d ContactSolver::NewBlocks::place_of(std::int32_t row) const {
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
  const double extent = box.sizes().maxCoeff(), scale = extent > 0 ? cells / extent : 0;
  for (std::size_t i = pieces_[item].first; i < pieces_[item].last; ++i) {
    const Eigen::Vector3d at = scale * (place_of(rows_[i]) - box.min());
    std::uint64_t code = 0;
    for (int k = 0; k < 3; ++k)
      code |= spread(static_cast<std::uint32_t>(std::min(at[k], cells))) << k;
    keys_[i] = code << 32 | static_cast<std::uint32_t>(rows_[i]);
  }
}

void ContactSolver::NewBlocks::claim(std::size_t item) {
  const std::size_t b = first_ + item;
  RowBlock& block = s_.blocks_[b];
  block.new_rows.clear();
  block.bodies.clear();
  block.shares.clear();
  block.vertices.clear();
  for (const std::int32_t i : block.rows) {
    s_.needs_[i].may_need_split = true;
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
        (now == 0 || (now < 0 && now > mark)) &&
        !__atomic_compare_exchange_n(&node, &now, mark, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
  }
}

void ContactSolver::NewBlocks::find_bodies(RowBlock& block, std::int32_t row) {
  const Contact& contact = s_.rows_->contact(row);
  const double normal_mass =
      s_.rows_->is_made(row) ? (*s_.rows_)[row].normal_mass : s_.rows_->estimate(row).normal_mass;
  for (const RigidTerm& term : RigidTerms(contact, contact.weights(), *s_.motion_)) {
    const RigidMotion& rigid = s_.motion_->rigid[term.body];
    if (rigid.articulated >= 0) continue;
    const auto found = std::find(block.bodies.begin(), block.bodies.end(), term.body);
    const auto at = static_cast<std::size_t>(found - block.bodies.begin());
    if (found == block.bodies.end()) {
      block.bodies.push_back(term.body);
      block.shares.push_back(0);
    }
    // An upper bound of the body's part of the row's compliance.
    const double compliance = term.weight * term.weight * rigid.inverse_mass.maxCoeff() +
                              term.arm.squaredNorm() * rigid.inverse_inertia.trace();
    block.shares[at] = std::max(block.shares[at], compliance * normal_mass);
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
    s_.vertex_of_node_.insert(s_.vertex_of_node_.end(), block.new_vertices.begin(),
                              block.new_vertices.end());
  }
  s_.displacement_.resize(static_cast<std::size_t>(next));
}

void ContactSolver::NewBlocks::find_slots(RowBlock& block) {
  block.slots.clear();
  for (const std::int32_t v : block.vertices) block.slots.push_back(s_.node_of_[v]);
  if (s_.motion_->articulated.empty()) return;
  for (const std::int32_t i : block.rows) {
    const Contact& contact = s_.rows_->contact(i);
    for (const RigidTerm& term : RigidTerms(contact, contact.weights(), *s_.motion_))
      if (s_.motion_->rigid[term.body].articulated >= 0)
        block.slots.push_back(s_.slot_of_multibody(term.body));
  }
}

void ContactSolver::NewBlocks::share_bodies() {
  const std::size_t known = s_.shared_.size();
  std::vector<double> shares;  // of the bodies that become shared
  for (std::size_t b = first_; b < s_.block_count_; ++b) {
    RowBlock& block = s_.blocks_[b];
    for (std::size_t i = 0; i < block.bodies.size(); ++i) {
      std::int32_t& index = s_.shared_of_[block.bodies[i]];
      if (index < 0) {
        index = static_cast<std::int32_t>(s_.shared_.size());
        s_.shared_.push_back({block.bodies[i], 0, {}});
        shares.push_back(0);
      }
      block.bodies[i] = index;
      const auto at = static_cast<std::size_t>(index);
      if (at >= known) shares[at - known] = std::max(shares[at - known], block.shares[i]);
    }
  }
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double most = 1 + max_split_growth / std::max(shares[i], 1e-9);
    const int split = static_cast<int>(
        std::min<double>(most, static_cast<double>(RowBatch::lanes) * max_shared_limit));
    s_.colours_.add_body(std::max(1, split / RowBatch::lanes));
  }
}

void ContactSolver::NewBlocks::colour() {
  const std::size_t known_bodies = static_cast<std::size_t>(std::count_if(
      s_.shared_.begin(), s_.shared_.end(), [](const SharedBody& body) { return body.limit > 0; }));
  s_.colours_.grow(s_.displacement_.size());
  for (std::size_t b = first_; b < s_.block_count_; ++b) {
    RowBlock& block = s_.blocks_[b];
    block.colour = s_.colours_.add_block(block.slots, block.bodies);
    s_.blocks_of_colour_[block.colour].push_back(static_cast<std::int32_t>(b));
    block.first_own = s_.displacement_count();
    s_.displacement_.resize(s_.displacement_.size() + RowBatch::vertices + 2 * block.bodies.size());
  }
  // The blocks that come first decide how light a body is taken for. Later ones keep to that.
  for (std::size_t i = known_bodies; i < s_.shared_.size(); ++i) {
    SharedBody& shared = s_.shared_[i];
    shared.limit = s_.colours_.close_body(static_cast<int>(i));
    RowBody& body = s_.bodies_[shared.rigid];
    for (float& x : body.inverse_mass) x *= static_cast<float>(shared.limit);
    for (auto& column : body.inverse_inertia)
      for (float& x : column) x *= static_cast<float>(shared.limit);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
