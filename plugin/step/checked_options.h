// What an application chose, with numbers that mean nothing put right.
#pragma once

#include <string>
#include <vector>

#include "lazyccd/bullet/options.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct CheckedOptions {
  SolverOptions options;
  std::vector<std::string> lines;  // one for each that was not taken
};

// The detector's own are the core's to check.
CheckedOptions check(const SolverOptions& options);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
