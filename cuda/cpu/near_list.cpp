#include "cpu/near_list.h"

#include <cmath>

namespace lazyccd {
namespace {

// Steps that a list should last for, for it costs more to make than without.
constexpr double least_steps = 2;

// Along each axis, at both ends of the step.
double farthest(const VertexRecord& record, const double* from) {
  double most = 0;
  for (int k = 0; k < 3; ++k) {
    most = std::fmax(most, std::fabs(record.x[k] - from[k]));
    most = std::fmax(most, std::fabs(record.x[3 + k] - from[k]));
  }
  return most;
}

}  // namespace

bool NearList::holds(const std::vector<VertexRecord>& records) const {
  if (!made_ || at_.size() != records.size()) return false;
  for (std::size_t v = 0; v < records.size(); ++v)
    if (farthest(records[v], at_[v].data()) > slack_) return false;
  return true;
}

bool NearList::begin(const std::vector<VertexRecord>& records) {
  made_ = false;
  for (const VertexRecord& record : records)
    if (least_steps * farthest(record, record.x) > slack_) return false;
  at_.resize(records.size());
  for (std::size_t v = 0; v < records.size(); ++v)
    at_[v] = {records[v].x[0], records[v].x[1], records[v].x[2]};
  return true;
}

}  // namespace lazyccd
