// Random SolverOptions of the adapter. Each option is an extreme value or the default.
#pragma once

#include <cstdint>

#include "lazyccd/bullet/options.h"

namespace lazyccd::test {

/// The same number gives the same options.
bullet::SolverOptions random_options(std::uint32_t number);

}  // namespace lazyccd::test
