// Orphans of one kind, sorted: what both backends ask whether an elementary pair is among them.
#pragma once

#include <cstdint>

#include "core/contact_math.h"

namespace lazyccd {

// Plain pointers: host or device memory. Of two edges the smaller index comes first.
struct OrphanList {
  const Candidate* pairs;
  const std::uint32_t* first;  // of the pairs of each primitive a, and the end
  std::uint32_t count;

  LAZYCCD_HD bool contains(ContactKind kind, Candidate pair) const {
    if (kind == ContactKind::edge_edge && pair.b < pair.a) pair = {pair.b, pair.a};
    for (std::uint32_t i = first[pair.a]; i < first[pair.a + 1]; ++i)
      if (pairs[i].b == pair.b) return true;
    return false;
  }
};

}  // namespace lazyccd
