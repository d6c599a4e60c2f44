// SolverOptions of the adapter that nobody would choose: each of them pushed to an end, or left alone.
#pragma once

#include <cstdint>

#include "lazyccd/bullet/options.h"

namespace lazyccd::test {

bullet::SolverOptions random_options(std::uint32_t number);

}  // namespace lazyccd::test
