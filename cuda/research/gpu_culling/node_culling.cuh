// Culling of pairs of nodes whose boxes overlap: whether tighter volumes are apart, and whether a
// node certainly cannot touch itself. Used only if the options request it.
#pragma once

#include <cstdint>

#include "core/bvh/node_pair.h"
#include "gpu/scene/group_view.cuh"
#include "research/volumes/oriented_box.h"

namespace lazyccd::gpu::research {

using namespace lazyccd::research;

/// The extents of a node along the diagonals of its 18-DOP, at both ends of the step.
struct NodeDiagonals {
  AxisExtent axis[kDiagonals];
};

/// Counters of one step, on the device until the host reads them.
struct CullingCounters {
  std::uint64_t culled_by_volume, culled_by_normal_cone;
  std::uint32_t orphans;
};

/// A node that may turn out unable to touch itself. Its boundary is a part of the array of all
/// boundaries' vertices: `count` vertices from `first` on.
struct NodePatch {
  std::uint32_t node, first, count;
};

struct CulledPairs;

}  // namespace lazyccd::gpu::research

namespace lazyccd::gpu {

/// Culling data per node. Pointers are null if the options do not request the data.
struct NodeCulling {
  static constexpr bool is_used = true;
  using Counts = research::CulledPairs;

  const research::OrientedBoxOf<float>* boxes;
  const research::NodeDiagonals* diagonals;
  const unsigned char* flat;  // nonzero: the node cannot touch itself
  research::CullingCounters* counters;

  static const NodeCulling& of(const NodeCulling* culling) { return *culling; }

  __device__ bool flat_node(std::uint32_t node) const { return flat != nullptr && flat[node] != 0; }

  /// Returns whether the oriented boxes of two nodes are certainly apart.
  __device__ bool boxes_apart(NodePair pair) const {
    return boxes != nullptr && apart(load_wide(boxes + pair.a), load_wide(boxes + pair.b));
  }
  /// Returns whether two nodes are certainly apart along a diagonal.
  __device__ bool diagonals_apart(NodePair pair) const {
    if (diagonals == nullptr) return false;
    int sign = 0;
    for (int k = 0; k < kDiagonals; ++k)
      sign |=
          apart_sign(load_wide(diagonals[pair.a].axis + k), load_wide(diagonals[pair.b].axis + k));
    return sign < 0;
  }
};

}  // namespace lazyccd::gpu

namespace lazyccd::gpu::research {

/// Counts of what one thread culls; added to the counters once.
struct CulledPairs {
  std::uint32_t by_volume = 0, flat = 0;

  /// Returns the visit of a pair after culling. Pairs of leaves are not tested here: their groups
  /// have diagonals too, at both ends of the step, and these are tested first.
  __device__ PairVisit cull(const NodeCulling& culling, NodePair pair, const PairVisit& visited) {
    constexpr PairVisit ended{false, 0, {}};
    if (pair.a == pair.b) {
      if (!culling.flat_node(pair.a)) return visited;
      ++flat;
      return ended;
    }
    if (visited.children == 0 || !(culling.boxes_apart(pair) || culling.diagonals_apart(pair)))
      return visited;
    ++by_volume;
    return ended;
  }

  /// Returns whether two leaves that pass all other tests have oriented boxes apart.
  __device__ bool leaves_apart(const NodeCulling& culling, NodePair pair) {
    const bool are_apart = pair.a != pair.b && culling.boxes_apart(pair);
    by_volume += are_apart;
    return are_apart;
  }

  __device__ void add_to(CullingCounters& counters) const {
    const auto add = [](std::uint64_t& counter, std::uint32_t count) {
      if (count != 0) atomicAdd(reinterpret_cast<unsigned long long*>(&counter), count + 0ull);
    };
    add(counters.culled_by_volume, by_volume);
    add(counters.culled_by_normal_cone, flat);
  }
};

}  // namespace lazyccd::gpu::research
