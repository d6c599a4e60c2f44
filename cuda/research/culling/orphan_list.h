// Orphan pairs of one kind, sorted. Both backends look up here whether an elementary pair is an
// orphan.
#pragma once

#include <cstdint>

#include "core/narrow/contact_math.h"

namespace lazyccd::research {

/// The orphan pairs. Plain pointers, to host or device memory. In a pair of edges the smaller index
/// comes first.
struct OrphanList {
  const Candidate* pairs;
  const std::uint32_t* first;  // index of the first pair of each primitive a, then the total count
  std::uint32_t count;

  LAZYCCD_HD bool contains(ContactKind kind, Candidate pair) const {
    if (kind == ContactKind::edge_edge && pair.b < pair.a) pair = {pair.b, pair.a};
    for (std::uint32_t i = first[pair.a]; i < first[pair.a + 1]; ++i)
      if (pairs[i].b == pair.b) return true;
    return false;
  }
};

}  // namespace lazyccd::research
