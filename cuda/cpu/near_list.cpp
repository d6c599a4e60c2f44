#include "cpu/near_list.h"

#include <cmath>

namespace lazyccd {
namespace {

// Steps that a list should last for, for it costs more to make than without.
constexpr double least_steps = 2;

// From `from`, at both ends of the step and so all the time; times scale, or a square might vanish.
double farthest_squared(const VertexRecord& record, const double* from, double scale) {
  double squared[2] = {0, 0};
  for (int end = 0; end < 2; ++end) {
    for (int k = 0; k < 3; ++k) {
      const double moved = (record.x[3 * end + k] - from[k]) * scale;
      squared[end] += moved * moved;
    }
  }
  return std::fmax(squared[0], squared[1]);
}

}  // namespace

bool NearList::holds(const std::vector<VertexRecord>& records) {
  if (!made_ || at_.size() != records.size()) return false;
  double squared = 0;
  for (std::size_t v = 0; v < records.size(); ++v)
    squared = std::fmax(squared, farthest_squared(records[v], at_[v].data(), scale_));
  const double moved = std::sqrt(squared) / scale_;
  if (!(moved <= slack_)) return false;
  set_reach(moved);
  return true;
}

bool NearList::begin(const std::vector<VertexRecord>& records, double scale) {
  constexpr double least_slack = 0x1p-400;  // of the scene: its square is a normal number
  made_ = false;
  if (!(slack_ * scale > least_slack)) return false;
  double squared = 0;
  for (const VertexRecord& record : records)
    squared = std::fmax(squared, farthest_squared(record, record.x, scale));
  if (!(least_steps * std::sqrt(squared) <= slack_ * scale)) return false;
  at_.resize(records.size());
  for (std::size_t v = 0; v < records.size(); ++v)
    at_[v] = {records[v].x[0], records[v].x[1], records[v].x[2]};
  scale_ = scale;
  set_reach(slack_);
  return true;
}

// Both primitives of a pair move no farther than their vertices. What stays so little above the
// separation that the test, which is conservative, may count it as near is tested.
void NearList::set_reach(double moved) {
  constexpr double of_separation = 0x1p-12,
                   of_scene = 0x1p-15;  // the latter scaled: core/elementary.h
  const double reach = separation_ * (1 + of_separation) + 2 * moved;
  reach_ = static_cast<float>(reach * scale_ + of_scene) * (1 + 0x1p-20f);
}

}  // namespace lazyccd
