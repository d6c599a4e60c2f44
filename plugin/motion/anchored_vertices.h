// The soft vertices that anchors fix to bodies which impulses move.
#pragma once

#include <LinearMath/btVector3.h>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Soft vertex that an anchor fixes to a body that impulses move. The body moves the vertex;
/// contact impulses on the vertex act on the body.
struct AnchoredVertex {
  btVector3 local;  ///< position in the frame of the body
  int rigid;        ///< index in Motion::rigid
};

/// A map from soft vertices to their anchors, in any order. A look-up is one read of an array.
class AnchoredVertices {
 public:
  using Entry = std::pair<std::int32_t, AnchoredVertex>;  // vertex and anchor

  bool empty() const { return entries_.empty(); }
  std::vector<Entry>::const_iterator begin() const { return entries_.begin(); }
  std::vector<Entry>::const_iterator end() const { return entries_.end(); }

  /// Null if the vertex has no anchor. Valid until the next change.
  const AnchoredVertex* find(std::int32_t vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return v < place_.size() && place_[v] >= 0 ? &entries_[place_[v]].second : nullptr;
  }
  /// Adds a vertex that has no anchor.
  void add(std::int32_t vertex, const AnchoredVertex& fixed) {
    const auto v = static_cast<std::size_t>(vertex);
    if (v >= place_.size()) place_.resize(v + 1, -1);
    place_[v] = static_cast<std::int32_t>(entries_.size());
    entries_.emplace_back(vertex, fixed);
  }
  /// Removes a vertex that has an anchor.
  void remove(std::int32_t vertex) {
    const std::int32_t place = place_[vertex];
    entries_[place] = entries_.back();
    place_[entries_[place].first] = place;
    place_[vertex] = -1;
    entries_.pop_back();
  }
  void clear() {
    for (const Entry& entry : entries_) place_[entry.first] = -1;
    entries_.clear();
  }

 private:
  std::vector<Entry> entries_;
  std::vector<std::int32_t>
      place_;  // by vertex, up to the last that had an anchor: in entries_, or -1
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
