// The sweeps of the contact solver.
#include "solver/contact_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "solver/contact_solver_parts.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// The sweeps end when the change of a sweep is below any visible speed (ContactSolver::min_speed)
// or, far from rest, below this fraction of the approach that the contacts stop.
constexpr double min_fraction = 3e-3;
// Contacts that approach more slowly, m/s, are at rest or soon will be. An error left there shows
// as creep, so they get more sweeps.
constexpr double slow_approach = 0.25;
// Contacts also count as resting if, with last step's impulses, no row is violated by more than
// this speed, m/s, whatever the load.
constexpr double resting_speed = 0.02;
// Their sweeps also end when the change is below this fraction of the load.
constexpr double min_fraction_at_rest = 1e-4;
// Factor of the number of sweeps for both.
constexpr int slow_sweep_factor = 4;
// Divisor of the number of sweeps for split impulses. Gaps that are still too narrow are restored
// in the next steps.
constexpr int split_sweep_divisor = 5;
// The same for rounds in turn with links.
constexpr int round_sweep_divisor = 10;
// Sweeps from one full sweep to the next. Most rows never act, so the sweeps in between visit only
// batches that carry an impulse. The interval doubles if a full sweep activated no new batch.
constexpr int first_full_sweep_interval = 8, max_full_sweep_interval = 1 << 20;
// Sweeps in which the impulse of sliding friction is a fraction of what would hold, as long as the
// contact carries a load. After them its size is a constant bound, like that of Tresca's friction:
// it has no other bound that goes to zero with the load, so contacts whose load comes and goes with
// their friction would never settle.
constexpr int sliding_sweeps = 8;
// Restart the extrapolation if a sweep's change exceeds this multiple of the smallest change so
// far.
constexpr float max_change_growth = 4;
// The sweeps also end where they stall, as between two heavy bodies that press on light nodes. The
// next step goes on from their impulses. They stall if, in an interval, the least change does not
// fall to half of that in the interval before, and all changes together are a small fraction of all
// that the sweeps have changed so far. An interval is a fraction of the limit of the sweeps.
constexpr int intervals_of_limit = 16, min_stall_interval = 25;
constexpr double stalled_fraction = 1e-4;

// Whether the batch has an impulse, or gets one by extrapolation.
bool is_active(const RowBatch& batch) {
  const auto is_not_zero = [](float x) { return x != 0; };
  return std::any_of(std::begin(batch.impulse), std::end(batch.impulse), is_not_zero) ||
         std::any_of(std::begin(batch.last_impulse), std::end(batch.last_impulse), is_not_zero);
}

// Keeps the active batches of a block that was swept.
void find_active(RowBlock& block) {
  block.active.clear();
  block.has_new_active = false;
  for (std::size_t i = 0; i < block.batches.size(); ++i) {
    RowBatch& batch = block.batches[i];
    const bool active = is_active(batch);
    block.has_new_active = block.has_new_active || (active && !batch.was_active);
    batch.was_active = active;
    if (active) block.active.push_back(static_cast<std::int32_t>(i));
  }
}

}  // namespace

// The sweeps of one solve(). run() and next() are those of Threads::run_phases().
class ContactSolver::Sweeps {
 public:
  Sweeps(ContactSolver& solver, int sweeps)
      : s_(solver), islands_(solver.problems_.size()), added_(solver) {
    for (std::size_t b = 0; b < s_.block_count_; ++b) islands_[s_.blocks_[b].island].goes_on = true;
    for (std::size_t i = 0; i < islands_.size(); ++i) {
      if (islands_[i].goes_on) set_limits(islands_[i], s_.problems_[i], sweeps);
    }
    s_.last_displacement_ = s_.displacement_;
  }

  std::size_t start() { return begin_sweep(); }

  void run(std::size_t item, int worker) {
    switch (phase_) {
      case Phase::search: {
        RowChunk& chunk = s_.chunks_[item];
        const Island& island = islands_[chunk.island];
        if (island.goes_on && island.is_full) return s_.find_violated(chunk);
        return chunk.violated.clear();
      }
      case Phase::add:
        return added_.run(item, worker);
      case Phase::sweep:
        return sweep(item);
      case Phase::join: {
        const SharedSlots::Grain& grain = stage().shared.grains()[item];
        if (islands_[grain.island].goes_on) s_.join(stage().shared, grain);
        return;
      }
      case Phase::extrapolate:
        return item < s_.block_count_ ? extrapolate_nodes(s_.blocks_[item]) : extrapolate_bodies();
    }
  }

  /// Number of sweeps so far.
  int count() const { return sweep_; }

  std::size_t next() {
    switch (phase_) {
      case Phase::search:
        return add_violated();
      case Phase::add: {
        const std::size_t count = added_.next();
        if (count > 0) return count;
        s_.last_displacement_.resize(s_.displacement_.size());
        return begin_stages();
      }
      case Phase::sweep:
        phase_ = Phase::join;
        if (!stage().shared.grains().empty()) return stage().shared.grains().size();
        [[fallthrough]];
      case Phase::join:
        return next_stage();
      case Phase::extrapolate:
        ++sweep_;
        return begin_sweep();
    }
    return 0;
  }

 private:
  enum class Phase { search, add, sweep, join, extrapolate };

  // Looks for sweeps that stall.
  struct Progress {
    int interval = 0,
        sweeps_left = 0;  // length of an interval, and what is left of the present one
    float least = std::numeric_limits<float>::max();  // SweepChange::largest, in the present one
    float last_least = std::numeric_limits<float>::max();  // and in the one before
    double size = 0, total_size = 0;  // sum of SweepChange::size, in the present one and in all

    void begin(int sweep_limit) {
      interval = sweeps_left = std::max(min_stall_interval, sweep_limit / intervals_of_limit);
    }
    /// Adds a sweep. Returns whether an interval ends in which the sweeps stalled.
    bool stalls(const SweepChange& change) {
      least = std::min(least, change.largest);
      size += change.size;
      total_size += change.size;
      if (--sweeps_left > 0) return false;
      constexpr float half_squared = 0.25F;  // SweepChange::largest is squared
      const bool stalled =
          least > half_squared * last_least && size < stalled_fraction * total_size;
      last_least = std::exchange(least, std::numeric_limits<float>::max());
      size = 0;
      sweeps_left = interval;
      return stalled;
    }
  };

  struct Island {
    bool goes_on = false;
    int limit = 0;         // of the number of sweeps
    float tolerance = 0;   // of the change of a sweep
    bool is_full = false;  // the present sweep is a full one
    int full_interval = first_full_sweep_interval, next_full = first_full_sweep_interval;
    float min_change_size = std::numeric_limits<float>::max();
    Progress progress;
    int run_length = 0;  // sweeps since the extrapolation was restarted
    float extrapolation = 0;
    SweepChange change;  // of the present sweep
    bool has_new_active = false;
  };

  void set_limits(Island& island, const Problem& problem, int sweeps) const {
    const double dt = s_.motion_->dt;
    double min_change = min_speed * dt;  // metres
    if (s_.for_split_impulse_) {
      sweeps = std::max(1, sweeps / split_sweep_divisor);
    } else if (s_.manner_ == Manner::round) {
      sweeps = std::max(1, sweeps / round_sweep_divisor);
      min_change = std::max(min_change, min_fraction * problem.largest.need);
    } else if (problem.largest.need < slow_approach * dt ||
               problem.max_violation < resting_speed * dt) {
      sweeps =
          std::min(sweeps, std::numeric_limits<int>::max() / slow_sweep_factor) * slow_sweep_factor;
      min_change = std::max(min_change, min_fraction_at_rest * problem.largest.need);
    } else {
      min_change = std::max(min_change, min_fraction * problem.largest.need);
    }
    island.limit = sweeps;
    island.progress.begin(sweeps);
    island.tolerance = static_cast<float>(min_change / problem.length_unit);
  }

  std::size_t begin_sweep() {
    bool any_full = false;
    for (Island& island : islands_) {
      island.is_full = sweep_ >= std::min(island.next_full, island.limit);
      any_full = any_full || (island.goes_on && island.is_full);
    }
    if (!any_full) return begin_stages();
    phase_ = Phase::search;
    return s_.chunk_count_;  // not 0, for there are blocks
  }

  std::size_t add_violated() {
    phase_ = Phase::add;
    const std::size_t count = added_.start(s_.take_violated());
    return count > 0 ? count : begin_stages();
  }

  std::size_t begin_stages() {
    for (std::size_t i = 0; i < s_.stage_count_; ++i) {
      Stage& stage = s_.stages_[i];
      stage.swept.clear();
      for (std::size_t b = stage.first; b < stage.last; ++b) {
        const RowBlock& block = s_.blocks_[b];
        const Island& island = islands_[block.island];
        // A block that has nothing to do sets its copies, which are joined with those of others.
        if (island.goes_on && (island.is_full || !block.active.empty() || !block.shared.empty()))
          stage.swept.push_back(static_cast<std::int32_t>(b));
      }
    }
    stage_ = -1;
    return next_stage();
  }

  std::size_t next_stage() {
    phase_ = Phase::sweep;
    do {
      if (++stage_ == static_cast<int>(s_.stage_count_)) return end_sweep();
    } while (stage().swept.empty());
    return stage().swept.size();
  }

  void sweep(std::size_t item) {
    const Indices& swept = stage().swept;
    RowBlock& block = s_.blocks_[swept[item]];
    const RowBatch* const next =
        item + 1 < swept.size() ? s_.blocks_[swept[item + 1]].batches.data() : nullptr;
    const Island& island = islands_[block.island];
    s_.read_shared(block);
    if (island.is_full && block.active.size() < block.batches.size()) {
      block.active.resize(block.batches.size());
      std::iota(block.active.begin(), block.active.end(), 0);
    }
    SweepMode mode;
    mode.extrapolation = island.extrapolation;
    mode.fixes_sliding = sweep_ >= sliding_sweeps;
    mode.next = next;
    block.change = s_.kernels_->sweep(s_.problem_of(block), block.active.data(),
                                      static_cast<int>(block.active.size()), mode);
    if (finds_active(island)) find_active(block);
  }

  bool finds_active(const Island& island) const { return island.is_full || sweep_ == 1; }

  std::size_t end_sweep() {
    for (Island& island : islands_) {
      island.change = {};
      island.has_new_active = false;
    }
    for (std::size_t i = 0; i < s_.stage_count_; ++i) {
      for (const std::int32_t b : s_.stages_[i].swept) {
        const RowBlock& block = s_.blocks_[b];
        Island& island = islands_[block.island];
        island.change.largest = std::max(island.change.largest, block.change.largest);
        island.change.size += block.change.size;
        island.change.restart_test += block.change.restart_test;
        island.has_new_active = island.has_new_active || block.has_new_active;
      }
    }
    bool any_goes_on = false;
    for (Island& island : islands_) {
      if (island.goes_on) end_sweep(island);
      any_goes_on = any_goes_on || island.goes_on;
    }
    phase_ = Phase::extrapolate;
    return any_goes_on ? s_.block_count_ + (s_.motion_->rigid.empty() ? 0 : 1) : 0;
  }

  void end_sweep(Island& island) const {
    const SweepChange& change = island.change;
    const bool settled = change.largest < island.tolerance * island.tolerance;
    // The last sweep is a full one, so that all impulses are within their bounds.
    if (island.is_full && (settled || sweep_ >= island.limit)) {
      island.goes_on = false;
      return;
    }
    island.run_length =
        change.restart_test < 0 || change.size > max_change_growth * island.min_change_size
            ? 1
            : island.run_length + 1;
    island.min_change_size = std::min(island.min_change_size, change.size);
    island.extrapolation =
        static_cast<float>(island.run_length - 1) / static_cast<float>(island.run_length + 2);
    if (island.is_full) {
      if (!island.has_new_active)
        island.full_interval = std::min(2 * island.full_interval, max_full_sweep_interval);
      island.next_full = sweep_ + island.full_interval;
    }
    if (settled) island.next_full = sweep_ + 1;
    if (island.progress.stalls(change)) island.limit = std::min(island.limit, sweep_ + 1);
  }

  void extrapolate(const Island& island, std::int32_t first, int count) const {
    s_.kernels_->extrapolate(island.extrapolation, &s_.displacement_[first],
                             &s_.last_displacement_[first], count);
  }

  void extrapolate_nodes(const RowBlock& block) const {
    if (islands_[block.island].goes_on && !block.new_vertices.empty())
      extrapolate(islands_[block.island], block.first_new_slot,
                  static_cast<int>(block.new_vertices.size()));
  }

  void extrapolate_bodies() const {
    for (std::size_t rigid = 0; rigid < s_.motion_->rigid.size(); ++rigid) {
      const std::int32_t island = s_.islands_->of_rigid(rigid);
      if (island >= 0 && islands_[island].goes_on)
        extrapolate(islands_[island], translation_slot(static_cast<std::int32_t>(rigid)), 2);
    }
  }

  const Stage& stage() const { return s_.stages_[static_cast<std::size_t>(stage_)]; }

  ContactSolver& s_;
  std::vector<Island> islands_;
  Phase phase_ = Phase::sweep;
  int sweep_ = 1, stage_ = -1;
  NewBlocks added_;
};

const Threads& ContactSolver::threads_of_blocks() const {
  return block_row_count_ < min_parallel_rows ? serial_ : threads_;
}

int ContactSolver::solve(int sweeps) {
  if (block_count_ == 0) return 0;
  Sweeps iteration(*this, sweeps);
  threads_of_blocks().run_phases(
      iteration.start(), [&](std::size_t item, int worker) { iteration.run(item, worker); },
      [&] { return iteration.next(); });
  for_each(chunk_count_, [this](std::size_t i, int) {
    RowChunk& chunk = chunks_[i];
    find_violated(chunk);
    for (const std::int32_t row : chunk.violated) needs_[chunk.inactive[row]].may_need_split = true;
  });
  return iteration.count();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
