// Decides whether a step launches the exact stage before it is known to be needed.
#pragma once

#include <cstdint>

namespace lazyccd::exact {

/// Even without queries the stage costs a launch. So steps leave it out once several steps in a row
/// needed none. If such a step turns out to need it, it runs behind the step, for the same
/// contacts.
class StagePolicy {
 public:
  /// Steps without a query until the stage is left out.
  static constexpr int kPatience = 8;

  /// Whether the next step launches the stage ahead. A new scene is taken to need none.
  bool launches_ahead() const { return idle_steps_ < kPatience; }
  /// Records how many queries the last step left to the stage.
  void record(std::uint64_t queries) {
    idle_steps_ = queries != 0 ? 0 : idle_steps_ < kPatience ? idle_steps_ + 1 : kPatience;
  }

 private:
  int idle_steps_ = kPatience;
};

}  // namespace lazyccd::exact
