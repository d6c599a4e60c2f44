// Catch2 2.13 and 3 from one source. Tests compare floating point with Matchers::WithinAbs or
// WithinRel; both versions have them, Approx moved.
#pragma once

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
#else
#include <catch2/catch.hpp>
#endif

namespace Matchers = Catch::Matchers;
