// The sweeps of the contact solver.
#include "settings.h"
#include "solver/contact_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "solver/contact_solver_parts.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

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
    for (std::size_t b = 0; b < s_.block_count_; ++b)
      if (s_.is_selected(s_.blocks_[b])) islands_[s_.blocks_[b].island].goes_on = true;
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
        s_.last_displacement_.insert(
            s_.last_displacement_.end(),
            s_.displacement_.begin() + static_cast<std::ptrdiff_t>(s_.last_displacement_.size()),
            s_.displacement_.end());
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
      interval = sweeps_left = std::max(settings::solver::min_stall_interval,
                                        sweep_limit / settings::solver::intervals_of_limit);
    }
    /// Adds a sweep. Returns whether an interval ends in which the sweeps stalled.
    bool stalls(const SweepChange& change) {
      least = std::min(least, change.largest);
      size += change.size;
      total_size += change.size;
      if (--sweeps_left > 0) return false;
      const bool stalled = least > settings::solver::stalled_change_squared * last_least &&
                           size < settings::solver::stalled_fraction * total_size;
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
    int full_interval = settings::solver::first_full_sweep_interval,
        next_full = settings::solver::first_full_sweep_interval;
    float min_change_size = std::numeric_limits<float>::max();
    Progress progress;
    int run_length = 0;  // sweeps since the extrapolation was restarted
    float extrapolation = 0;
    SweepChange change;  // of the present sweep
    bool has_new_active = false;
  };

  void set_limits(Island& island, const Problem& problem, int sweeps) const {
    const double dt = s_.motion_->dt();
    double min_change = settings::solver::min_speed * dt;  // metres
    if (s_.for_split_impulse_) {
      sweeps = std::max(1, sweeps / settings::solver::split_sweep_divisor);
    } else if (s_.manner_ == Manner::round) {
      sweeps = std::max(1, sweeps / settings::solver::round_sweep_divisor);
      min_change = std::max(min_change, settings::solver::min_fraction * problem.largest.need);
    } else if (problem.largest.need < settings::solver::slow_approach * dt ||
               problem.max_violation < settings::solver::resting_speed * dt) {
      const int factor = settings::solver::slow_sweep_factor;
      sweeps = std::min(sweeps, std::numeric_limits<int>::max() / factor) * factor;
      min_change =
          std::max(min_change, settings::solver::min_fraction_at_rest * problem.largest.need);
    } else {
      min_change = std::max(min_change, settings::solver::min_fraction * problem.largest.need);
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
    s_.take_violated();
    const std::size_t count = added_.start();
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
    mode.fixes_sliding = sweep_ >= settings::solver::sliding_sweeps;
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
    return any_goes_on ? s_.block_count_ + (s_.motion_->rigid().empty() ? 0 : 1) : 0;
  }

  void end_sweep(Island& island) const {
    const SweepChange& change = island.change;
    if (sweep_ == 1 && s_.manner_ == Manner::round)
      island.tolerance =
          std::max(island.tolerance, static_cast<float>(settings::solver::round_fraction) *
                                         std::sqrt(change.largest));
    const bool settled = change.largest < island.tolerance * island.tolerance;
    // The last sweep is a full one, so that all impulses are within their bounds.
    if (island.is_full && (settled || sweep_ >= island.limit)) {
      island.goes_on = false;
      return;
    }
    island.run_length =
        change.restart_test < 0 ||
                change.size > settings::solver::max_change_growth * island.min_change_size
            ? 1
            : island.run_length + 1;
    island.min_change_size = std::min(island.min_change_size, change.size);
    island.extrapolation =
        static_cast<float>(island.run_length - 1) / static_cast<float>(island.run_length + 2);
    if (island.is_full) {
      const int left = island.limit - sweep_;
      if (!island.has_new_active)
        island.full_interval = island.full_interval > left / 2 ? left : 2 * island.full_interval;
      island.next_full = sweep_ + std::min(island.full_interval, left);
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
    for (std::size_t rigid = 0; rigid < s_.motion_->rigid().size(); ++rigid) {
      const std::int32_t island = s_.islands_->of_rigid(rigid);
      if (island >= 0 && islands_[island].goes_on)
        extrapolate(islands_[island], translation_slot(static_cast<std::int32_t>(rigid)), 2);
    }
  }

  const Stage& stage() const { return s_.stages_[static_cast<std::size_t>(stage_)]; }

  ContactSolver& s_;
  ScratchVector<Island> islands_;
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
  return iteration.count();
}

void ContactSolver::mark_violated() {
  if (block_count_ == 0) return;
  for_each(chunk_count_, [this](std::size_t i, int) {
    RowChunk& chunk = chunks_[i];
    if (!islands_->is_selected(chunk.island)) return;
    find_violated(chunk);
    for (const std::int32_t row : chunk.violated)
      rows_->set_may_need_split(static_cast<std::size_t>(chunk.inactive[row]), true);
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
