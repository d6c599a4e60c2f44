// The choice, for each step of a program, between all threads and the calling thread alone, from
// the times of the steps so far. Both give the same result. A second thread costs processor time
// that the program has other uses for, and in small steps it costs more than it saves.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>

#include "lazyccd/export.h"
#include "lazyccd/threads.h"

namespace lazyccd {

class TrialChoice;

/// Now and then some steps run in the other way. Such trials cost at most 2 % of the time.
class LAZYCCD_API ThreadChoice {
 public:
  /// Scenes with fewer vertices begin on one thread.
  static constexpr std::size_t min_vertices = 4096;
  /// Steps that take less on one thread never use more, milliseconds.
  static constexpr double min_ms = 0.2;
  /// Steps below this use all threads only if they end sooner by more than they burn, milliseconds.
  static constexpr double small_ms = 0.5;
  /// Steps that take longer on one thread use all at once, unless a trial has shown otherwise,
  /// milliseconds.
  static constexpr double large_ms = 1;

  /// Chooses only if `is_automatic`; otherwise all threads take part, always.
  ThreadChoice(const Threads& threads, bool is_automatic);
  ~ThreadChoice();

  /// Begins a step of a scene with this number of vertices. Calls Threads::set_caller_only().
  void begin_step(std::size_t vertices);
  /// Ends the step that began last. Call it before other parts of the program run.
  void end_step();
  /// Records a step by its wall time, milliseconds, in place of end_step().
  void record(double ms);
  /// Whether all threads take part. Valid from begin_step() to the end of the step.
  bool uses_all_threads() const;

 private:
  Threads threads_;
  std::unique_ptr<TrialChoice> trials_;  // null: there is no choice
  bool has_begun_ = false;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace lazyccd
