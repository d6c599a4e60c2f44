// Random SolverOptions of the adapter. Each option is an extreme value or the default.
#pragma once

#include <cstdint>

#include "lazyccd/bullet/options.h"

namespace lazyccd::test {

/// Options of random scenes. What the application puts elsewhere is swept from where it was, and
/// what intersects stays. Otherwise crossings that the options allow would count as faults.
bullet::SolverOptions strict_options();
/// The same number gives the same options.
bullet::SolverOptions random_options(std::uint32_t number);

}  // namespace lazyccd::test
