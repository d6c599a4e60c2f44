#include "step/checked_options.h"

#include <limits>
#include <sstream>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

template <class T>
struct Range {
  const char* name;
  T SolverOptions::*value;
  T least, most;
};

constexpr double any = std::numeric_limits<double>::max();  // that is finite
constexpr int many = std::numeric_limits<int>::max();

constexpr Range<double> numbers[] = {
    {"thickness", &SolverOptions::thickness, -any, any},
    {"position_correction", &SolverOptions::position_correction, 0, 1},
    {"restitution", &SolverOptions::restitution, 0, 1},
    {"restitution_threshold", &SolverOptions::restitution_threshold, 0, any},
    {"rest_speed", &SolverOptions::rest_speed, 0, any},
    {"rest_damping", &SolverOptions::rest_damping, 0, any},
    {"untangling_speed", &SolverOptions::untangling_speed, 0, any}};

constexpr Range<int> counts[] = {{"max_detections", &SolverOptions::max_detections, 0, many},
                                 {"solver_iterations", &SolverOptions::solver_iterations, 0, many},
                                 {"max_impact_zones", &SolverOptions::max_impact_zones, 0, many}};

template <class T>
void check(const Range<T>& range, CheckedOptions& checked) {
  T& value = checked.options.*range.value;
  if (value >= range.least && value <= range.most) return;  // false of what is no number
  const T usual = SolverOptions().*range.value;
  std::ostringstream line;
  line << "SolverOptions::" << range.name << " is " << value << ", which is out of its range; " << usual
       << " is used";
  checked.lines.push_back(line.str());
  value = usual;
}

}  // namespace

CheckedOptions check(const SolverOptions& options) {
  CheckedOptions checked{options, {}};
  for (const Range<double>& range : numbers) check(range, checked);
  for (const Range<int>& range : counts) check(range, checked);
  return checked;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
