// The cells of a mesh: what the groups of the hierarchy are cut from.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/bvh/cell.h"
#include "host/threads/noinit_vector.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// All faces and free edges, by world and body; of each body first the faces, then the free edges,
/// in ascending order.
class Cells {
 public:
  void build(Span<const Face> faces, Span<const Edge> edges, Span<const std::int32_t> free_edges,
             Span<const std::int32_t> body_of_vertex, std::size_t body_count,
             Span<const std::int32_t> world_of_body, ThreadPool& pool);

  /// Sets the segments alone; build() finds the same.
  void set_segments(std::vector<CellSegment> segments) { segments_ = std::move(segments); }

  /// By cell: index of its face or edge.
  const NoinitVector<std::int32_t>& primitives() const { return primitives_; }
  const std::vector<CellSegment>& segments() const { return segments_; }
  std::size_t group_count() const {
    return segments_.empty()
               ? 0
               : static_cast<std::size_t>(segments_.back().first_group + segments_.back().groups());
  }

  /// Calls body(segment, first, last) for the parts of the range of cells that are in one segment.
  template <class Body>
  void for_each_part(std::size_t first, std::size_t last, Body&& body) const {
    visit(&CellSegment::first, first, last, body);
  }
  /// The same for a range of groups.
  template <class Body>
  void for_each_part_of_groups(std::size_t first, std::size_t last, Body&& body) const {
    visit(&CellSegment::first_group, first, last, body);
  }

 private:
  template <class Body>
  void visit(std::int32_t CellSegment::*begin, std::size_t first, std::size_t last,
             Body&& body) const {
    auto segment = std::upper_bound(segments_.begin(), segments_.end(), first,
                                    [&](std::size_t i, const CellSegment& s) {
                                      return i < static_cast<std::size_t>(s.*begin);
                                    }) -
                   1;
    while (first < last) {
      const auto next = segment + 1;
      const std::size_t end =
          next == segments_.end() ? last : std::min(last, static_cast<std::size_t>((*next).*begin));
      body(*segment, first, end);
      first = end;
      segment = next;
    }
  }

  NoinitVector<std::int32_t> primitives_;
  std::vector<CellSegment> segments_;
};

}  // namespace lazyccd
