// Candidates for a minimum separation that outlast a step (Verlet 1967, "Computer experiments on
// classical fluids"): sought with a little more room than need be, they are all that can come that
// near until something has moved through half of it.
#pragma once

#include <array>
#include <vector>

#include "core/contact_math.h"
#include "cpu/groups.h"

namespace lazyccd {

class NearList {
 public:
  explicit NearList(double separation) : slack_(separation / 4) {}

  // By how much further than a step needs boxes have to grow on every side for a list.
  double slack() const { return slack_; }
  // Whether all that can come near in this step is listed.
  bool holds(const std::vector<VertexRecord>& records) const;
  // Takes this step for the one that the list is made in. False, and then there is no list, where
  // things move so fast that it would not last.
  bool begin(const std::vector<VertexRecord>& records);
  void forget() { made_ = false; }

  // To be filled after begin(), which complete() then ends.
  std::vector<Candidate> of[2];  // by ContactKind
  void complete() { made_ = true; }

  std::size_t bytes() const {
    return (of[0].capacity() + of[1].capacity()) * sizeof(Candidate) +
           at_.capacity() * sizeof(at_[0]);
  }

 private:
  double slack_;
  bool made_ = false;
  std::vector<std::array<double, 3>> at_;  // where the step began
};

}  // namespace lazyccd
