// A choice between two ways to do the same work, from the times of the runs so far.
//
// Now and then the other way gets a trial of a few runs. It takes over if it needs less than a
// given fraction of the time that the present way needs before and after the trial. What trials
// cost over the runs that they replace is spent from a budget: `max_trial_share` of the whole time.
// The next trial waits until the budget allows for it.
#pragma once

#include <array>
#include <cstddef>

namespace lazyccd {

/// Whether two times or sizes are so near to each other that a trial would end in the same way.
bool are_similar(double a, double b);

class TrialChoice {
 public:
  static constexpr double max_trial_share = 0.02;

  /// What decides about a trial, at the present median time of the current way.
  struct Rule {
    bool may_try;     ///< whether a trial may begin
    double min_gain;  ///< the other way takes over if it needs less than this fraction of the time
  };

  TrialChoice() = default;
  /// `first`: the way to begin with, 0 or 1. `trial_cost_ms`: what the first trial is expected to
  /// cost over the runs that it replaces, milliseconds. `first_interval`: runs before it.
  TrialChoice(int first, double trial_cost_ms, int first_interval);

  /// The way of the next run, 0 or 1.
  int next() const { return is_trial() ? 1 - current_ : current_; }
  /// The way outside of trials.
  int current() const { return current_; }
  /// Median wall time of the last runs of the current way, milliseconds; that of the last trial if
  /// there were few since, and 0 before it.
  double median() const { return times_.is_full() ? times_.median() : last_median_ms_; }
  /// Whether a trial at about this median time, milliseconds, was the last one.
  bool was_tried_at(double median) const { return are_similar(median, last_median_ms_); }
  /// Changes the current way without a trial.
  void change();
  /// Records the wall time, milliseconds, of a run of next(), with all that it prepared.
  void record(double ms, const Rule& rule);
  /// Forgets the times of the last runs and a trial that is not at its end. Call it when the work
  /// has changed and will take about the same time as before.
  void restart();

 private:
  // Times of the last runs. A median ignores the pauses that other programs cause.
  class Times {
   public:
    void clear() { count_ = 0; }
    void add(double ms) { ms_[count_++ % size] = ms; }
    bool is_full() const { return count_ >= size; }
    double median() const;

   private:
    static constexpr std::size_t size = 5;
    std::array<double, size> ms_{};
    std::size_t count_ = 0;
  };

  // The first runs of a way after another build what later ones keep. They tell nothing of those.
  static constexpr int warm_up_runs = 3, trial_runs = warm_up_runs + 5;

  bool is_trial() const { return left_in_trial_ > 0; }
  void record_trial(double ms);
  void end_trial(bool is_hopeless);
  void judge(double min_gain);
  bool starts_trial() const;

  int current_ = 0;
  Times times_, trial_times_;      // of the current way, and of the other one in its last trial
  int warm_up_ = warm_up_runs;     // runs that are still to be ignored
  int left_in_trial_ = 0;          // runs until the trial ends; 0: there is none
  bool awaits_judgement_ = false;  // the trial has ended, and the runs after it are measured

  double total_ms_ = 0;                 // of all runs
  double spent_ms_ = 0;                 // by all trials, over what they replaced
  double trial_cost_ms_ = 0;            // what the next trial is expected to spend
  double last_median_ms_ = 0;           // of the current way at the last trial
  int since_trial_ = 0, interval_ = 0;  // runs since the last trial, and before the next one
};

}  // namespace lazyccd
