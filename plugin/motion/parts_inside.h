// Parts of soft bodies that are inside of obstacles, or pass through their surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Each with the body of its obstacle. contains() needs sorted lists.
struct PartsInside {
  std::vector<std::array<std::int32_t, 2>> vertices;  ///< vertex, body
  std::vector<std::array<std::int32_t, 3>> edges;     ///< two vertices, the smaller first; body
  std::vector<std::array<std::int32_t, 4>> faces;     ///< three vertices, ascending; body

  bool empty() const { return vertices.empty() && edges.empty() && faces.empty(); }
  void sort();  ///< and removes duplicates
  /// True if a part of the primitive is listed: one of its vertices, an edge of it, or itself.
  /// `soft`: one vertex, or the two of an edge, or the three of a face.
  bool contains(Span<const std::int32_t> soft, std::int32_t body) const;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
