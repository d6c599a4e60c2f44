// Candidates for a minimum separation that outlast a step (Verlet 1967, "Computer experiments on
// classical fluids"): sought with a little more room than need be, they are all that can come that
// near until something has moved through half of it. Of these, a step tests those that can come
// that near for as little as things have moved up to now.
#pragma once

#include <array>
#include <vector>

#include "core/contact_math.h"
#include "cpu/groups.h"
#include "cpu/leaf.h"

namespace lazyccd {

class NearList {
 public:
  explicit NearList(double separation) : separation_(separation), slack_(separation / 4) {}

  // By how much further than a step needs boxes have to grow on every side for a list.
  double slack() const { return slack_; }
  // Whether all that can come near in this step is listed. Then reach() is as far apart as what
  // comes near can have been where the list was made, as ListedCandidate has it.
  bool holds(const std::vector<VertexRecord>& records);
  float reach() const { return reach_; }
  // Takes this step, of this scale, for the one that the list is made in; reach() is for that of
  // all its steps. False, and then there is no list, where things move so fast that it would not
  // last.
  bool begin(const std::vector<VertexRecord>& records, double scale);
  void forget() { made_ = false; }

  // To be filled after begin(), which complete() then ends.
  std::vector<ListedCandidate> of[2];  // by ContactKind
  void complete() { made_ = true; }

  std::size_t bytes() const {
    return (of[0].capacity() + of[1].capacity()) * sizeof(ListedCandidate) +
           at_.capacity() * sizeof(at_[0]);
  }

 private:
  void set_reach(double moved);

  double separation_, slack_;
  bool made_ = false;
  double scale_ = 1;
  float reach_ = 0;
  std::vector<std::array<double, 3>> at_;  // where the step began
};

}  // namespace lazyccd
