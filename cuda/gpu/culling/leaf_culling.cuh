// How the candidates of pairs of groups are filtered where the options are not the default.
#pragma once

#include "core/orphan_list.h"

namespace lazyccd::gpu {

struct LeafCulling {
  bool non_penetration;   // the filter of pairs that are never coplanar is on
  bool orphan_sets;       // candidates that are orphans are dropped: others test them
  OrphanList orphans[2];  // by ContactKind

  __device__ bool drops(ContactKind kind, Candidate pair) const {
    return orphan_sets && orphans[static_cast<int>(kind)].contains(kind, pair);
  }
};

}  // namespace lazyccd::gpu
