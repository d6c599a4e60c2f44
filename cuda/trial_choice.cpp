#include "trial_choice.h"

#include <algorithm>

namespace lazyccd {
namespace {

// A trial ends early if a run after the warm-up needs this many times the other's time.
constexpr double hopeless = 2;
// Runs between two trials. The number doubles with each trial that changes nothing. If the cost has
// changed by the factor, the next trial comes sooner.
constexpr int min_interval = 100, max_interval = 1000, interval_after_change = 20;
constexpr double changed_cost = 1.5;

int longer(int interval) { return std::min(std::max(2 * interval, min_interval), max_interval); }

}  // namespace

bool are_similar(double a, double b) { return a <= changed_cost * b && b <= changed_cost * a; }

double TrialChoice::Times::median() const {
  std::array<double, size> sorted = ms_;
  const auto middle = sorted.begin() + size / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

TrialChoice::TrialChoice(int first, double trial_cost_ms, int first_interval)
    : current_(first), trial_cost_ms_(trial_cost_ms), interval_(first_interval) {}

void TrialChoice::restart() {
  left_in_trial_ = 0;
  awaits_judgement_ = false;
  warm_up_ = warm_up_runs;
  times_.clear();
}

void TrialChoice::change() {
  restart();
  current_ = 1 - current_;
  since_trial_ = 0;
  interval_ = min_interval;
  last_median_ms_ = 0;
}

void TrialChoice::record(double ms, const Rule& rule) {
  total_ms_ += ms;
  if (is_trial()) return record_trial(ms);
  ++since_trial_;
  if (warm_up_ > 0) {
    --warm_up_;
    return;
  }
  times_.add(ms);
  if (awaits_judgement_ && times_.is_full()) judge(rule.min_gain);
  if (!rule.may_try || !starts_trial()) return;
  left_in_trial_ = trial_runs;
  trial_times_.clear();
  trial_cost_ms_ = 0;
  if (!are_similar(times_.median(), last_median_ms_)) interval_ = min_interval;
  last_median_ms_ = times_.median();
}

bool TrialChoice::starts_trial() const {
  if (!times_.is_full()) return false;
  const bool has_changed = last_median_ms_ > 0 && !are_similar(times_.median(), last_median_ms_);
  if (since_trial_ < (has_changed ? std::min(interval_, interval_after_change) : interval_))
    return false;
  return spent_ms_ + trial_cost_ms_ <= max_trial_share * total_ms_;
}

void TrialChoice::record_trial(double ms) {
  --left_in_trial_;
  const double excess = std::max(0.0, ms - last_median_ms_);
  const bool is_first = left_in_trial_ == trial_runs - 1;
  // The first run may have started a device or threads. In the next trial it will cost what the
  // second costs now.
  const bool is_second = left_in_trial_ == trial_runs - 2;
  spent_ms_ += excess;
  trial_cost_ms_ += is_first ? 0 : is_second ? 2 * excess : excess;
  if (left_in_trial_ >= trial_runs - warm_up_runs) {
    if (!is_first && trial_cost_ms_ > max_trial_share * total_ms_) end_trial(true);
    return;
  }
  trial_times_.add(ms);
  if (left_in_trial_ == 0)
    end_trial(false);
  else if (ms > hopeless * last_median_ms_)
    end_trial(true);
}

void TrialChoice::end_trial(bool is_hopeless) {
  left_in_trial_ = 0;
  since_trial_ = 0;
  warm_up_ = warm_up_runs;
  times_.clear();
  awaits_judgement_ = !is_hopeless;
  if (is_hopeless) interval_ = longer(interval_);
}

void TrialChoice::judge(double min_gain) {
  awaits_judgement_ = false;
  const double median_around = (last_median_ms_ + times_.median()) / 2;
  if (trial_times_.median() >= min_gain * median_around) {
    interval_ = longer(interval_);
    return;
  }
  current_ = 1 - current_;
  warm_up_ = warm_up_runs;
  times_ = trial_times_;
  last_median_ms_ = times_.median();
  interval_ = min_interval;
}

}  // namespace lazyccd
