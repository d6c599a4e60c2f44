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
  T lowest, highest;
};

constexpr double max_double = std::numeric_limits<double>::max();
constexpr int max_int = std::numeric_limits<int>::max();

constexpr Range<double> numbers[] = {
    {"thickness", &SolverOptions::thickness, -max_double, max_double},
    {"position_correction", &SolverOptions::position_correction, 0, max_double},
    {"restitution", &SolverOptions::restitution, 0, 1},
    {"restitution_threshold", &SolverOptions::restitution_threshold, 0, max_double},
    {"jump_speed", &SolverOptions::jump_speed, 0, max_double},
    {"rest_speed", &SolverOptions::rest_speed, 0, max_double},
    {"rest_damping", &SolverOptions::rest_damping, 0, max_double},
    {"strain_limit", &SolverOptions::strain_limit, 0, max_double},
    {"untangling_speed", &SolverOptions::untangling_speed, 0, max_double}};

constexpr Range<int> counts[] = {
    {"max_impulse_rounds", &SolverOptions::max_impulse_rounds, 0, max_int},
    {"solver_iterations", &SolverOptions::solver_iterations, 0, max_int},
    {"max_zone_rounds", &SolverOptions::max_zone_rounds, 0, max_int}};

template <class T>
void check(const Range<T>& range, CheckedOptions& checked) {
  T& value = checked.options.*range.value;
  if (value >= range.lowest && value <= range.highest) return;  // false for NaN
  const T default_value = SolverOptions().*range.value;
  std::ostringstream line;
  line << "SolverOptions::" << range.name << " is " << value
       << ", which is out of range; the default, " << default_value << ", is used";
  checked.lines.push_back(line.str());
  value = default_value;
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
