// Includes Catch2, version 2.13 or 3. Matchers have their version 3 names. Compare floating-point
// numbers with WithinAbs or WithinRel, which both versions have.
#pragma once

#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
namespace Matchers = Catch::Matchers;
#else
#include <catch2/catch.hpp>
namespace Matchers {
using namespace Catch::Matchers;
inline auto ContainsSubstring(const std::string& text) { return Catch::Matchers::Contains(text); }
}  // namespace Matchers
#endif
