// Counts what a test allocates.
#pragma once

namespace lazyccd::test {

/// Number of allocations by `new` on this thread so far; 0 in sanitizer builds, which have an
/// allocator of their own.
long allocation_count();

}  // namespace lazyccd::test
