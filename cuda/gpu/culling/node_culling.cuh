// What a traversal asks of pairs of nodes whose boxes overlap: whether tighter volumes are apart,
// and whether a node is certainly apart from itself. Only where the options ask for it.
#pragma once

#include <cstdint>

#include "core/node_pair.h"
#include "core/oriented_box.h"
#include "gpu/scene/group_view.cuh"

namespace lazyccd::gpu {

// The diagonals of a node's 18-DOP, at both ends of the step.
struct NodeDiagonals {
  AxisExtent axis[kDiagonals];
};

// Of one step, on the device until the host reads it.
struct CullingCounters {
  std::uint64_t volume_culled, culled_by_normal_cone;
  std::uint32_t orphans;
};

// A node that could be apart from itself: its boundary is `count` of all boundaries' vertices.
struct NodePatch {
  std::uint32_t node, first, count;
};

// By node; null where not asked for.
struct NodeCulling {
  const OrientedBoxOf<float>* boxes;
  const NodeDiagonals* diagonals;
  const unsigned char* flat;  // nonzero: apart from itself
  CullingCounters* counters;

  __device__ bool flat_node(std::uint32_t node) const { return flat != nullptr && flat[node] != 0; }

  // Whether the volumes of two nodes certainly do not touch.
  __device__ bool boxes_apart(NodePair pair) const {
    return boxes != nullptr && apart(load_wide(boxes + pair.a), load_wide(boxes + pair.b));
  }
  __device__ bool diagonals_apart(NodePair pair) const {
    if (diagonals == nullptr) return false;
    int sign = 0;
    for (int k = 0; k < kDiagonals; ++k)
      sign |=
          apart_sign(load_wide(diagonals[pair.a].axis + k), load_wide(diagonals[pair.b].axis + k));
    return sign < 0;
  }
};

// What one thread culls; added up once.
struct CulledPairs {
  std::uint32_t by_volume = 0, flat = 0;

  // What becomes of a pair after a second look. Of a pair of leaves it is too early: their groups
  // have diagonals too, and those of both ends of the step, so they are asked first.
  __device__ PairVisit look(const NodeCulling& culling, NodePair pair, const PairVisit& visited) {
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

  // Of a pair of leaves that is worth a visit otherwise.
  __device__ bool leaves_apart(const NodeCulling& culling, NodePair pair) {
    const bool parted = pair.a != pair.b && culling.boxes_apart(pair);
    by_volume += parted;
    return parted;
  }

  __device__ void add_to(CullingCounters& counters) const {
    const auto add = [](std::uint64_t& counter, std::uint32_t count) {
      if (count != 0) atomicAdd(reinterpret_cast<unsigned long long*>(&counter), count + 0ull);
    };
    add(counters.volume_culled, by_volume);
    add(counters.culled_by_normal_cone, flat);
  }
};

}  // namespace lazyccd::gpu
