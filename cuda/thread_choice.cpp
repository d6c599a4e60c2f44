#include "lazyccd/thread_choice.h"

#include "trial_choice.h"

namespace lazyccd {
namespace {

// The two ways of TrialChoice.
constexpr int caller = 0, all = 1;

// Steps before the first trial.
constexpr int runs_before_trial = 20;
// All threads take over if they need less than this part of the time of one thread. One thread does
// if it needs less than this part of the time of all. In small steps processor time counts
// too: two threads that need 0.6 of the time end sooner by 0.4 and burn 0.2 more.
constexpr double all_gain = 0.95, caller_gain = 1;
constexpr double small_all_gain = 0.6, small_caller_gain = 1.4;

}  // namespace

ThreadChoice::ThreadChoice(const Threads& threads, bool is_automatic) : threads_(threads) {
  if (is_automatic && threads.count() > 1) trials_ = std::make_unique<TrialChoice>();
}

ThreadChoice::~ThreadChoice() = default;

bool ThreadChoice::uses_all_threads() const { return !trials_ || trials_->next() == all; }

void ThreadChoice::begin_step(std::size_t vertices) {
  if (!trials_) return;
  if (!has_begun_ && vertices > 0) {
    *trials_ = TrialChoice(vertices < min_vertices ? caller : all, 0, runs_before_trial);
    has_begun_ = true;
  }
  threads_.set_caller_only(!uses_all_threads());
  start_ = std::chrono::steady_clock::now();
}

void ThreadChoice::end_step() {
  const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start_;
  record(ms.count());
}

void ThreadChoice::record(double ms) {
  if (!trials_) return;
  const double median = trials_->median();
  const bool is_small = median < small_ms;
  if (trials_->current() == caller) {
    trials_->record(ms, {median >= min_ms, is_small ? small_all_gain : all_gain});
    if (trials_->next() == caller && trials_->median() > large_ms &&
        !trials_->was_tried_at(trials_->median()))
      trials_->change();
  } else {
    trials_->record(ms, {true, is_small ? small_caller_gain : caller_gain});
  }
}

}  // namespace lazyccd
