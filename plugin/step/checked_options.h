// Checks the options of an application and replaces values that are out of range.
#pragma once

#include <string>
#include <vector>

#include "lazyccd/bullet/options.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Options within their ranges, and what was replaced.
struct CheckedOptions {
  SolverOptions options;
  std::vector<std::string> lines;  ///< one warning for each value that was replaced
};

/// Replaces each number that is not finite or out of range by its default. Does not check
/// SolverOptions::detector; the core does.
CheckedOptions check(const SolverOptions& options);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
