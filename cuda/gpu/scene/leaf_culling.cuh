// How the leaf kernel filters candidates if the options differ from the default.
#pragma once

#include "core/bvh/orphan_list.h"

namespace lazyccd::gpu {

/// The options of the filter, and the orphan sets.
struct LeafCulling {
  bool non_penetration;   // the non-coplanar filter is on
  bool orphan_sets;       // drop orphans: filter_orphans() tests them
  OrphanList orphans[2];  // by ContactKind

  /// Returns whether to drop a candidate, because it is an orphan.
  __device__ bool drops(ContactKind kind, Candidate pair) const {
    return orphan_sets && orphans[static_cast<int>(kind)].contains(kind, pair);
  }
};

}  // namespace lazyccd::gpu
