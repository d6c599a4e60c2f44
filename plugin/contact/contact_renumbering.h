// What is known about contacts outlasts a change of the scene, as far as it is about bodies that
// did not change. So a body that comes or goes does not change how others move.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "contact/renumbering.h"
#include "lazyccd/contact.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The indices of a scene by which contacts name primitives, by body.
class PrimitiveIndices {
 public:
  struct OfBody {
    IndexRange vertices, faces, own_edges;  ///< in StepTopology
    IndexRange edges;                       ///< in Detector::edges()
  };

  PrimitiveIndices() = default;
  /// `first_side`, `first_own_edge`: as first_side_index() and first_edge_index().
  PrimitiveIndices(std::vector<OfBody> bodies, std::int32_t first_side, std::int32_t first_own_edge)
      : bodies_(std::move(bodies)), first_side_(first_side), first_own_edge_(first_own_edge) {}
  /// `edges`: as Detector::edges().
  PrimitiveIndices(const StepTopology& topology, Span<const Edge> edges);

  const std::vector<OfBody>& bodies() const { return bodies_; }
  /// A contact names an edge by its index in Detector::edges(), as the side of a face, or as one of
  /// the topology's own edges (step_topology.h). Gives an edge of `from` its index here.
  std::int32_t edge_index(std::int32_t edge, const OfBody& own, const PrimitiveIndices& from,
                          const OfBody& own_from) const;

 private:
  std::vector<OfBody> bodies_;
  std::int32_t first_side_ = 0, first_own_edge_ = 0;
};

class ContactRenumbering {
 public:
  /// Between the indices `from` and `to`. `numbers`: of bodies and vertices. `is_changed`: by new
  /// index, whether the body is new or changed. The arguments must outlive it.
  ContactRenumbering(const PrimitiveIndices& from, const PrimitiveIndices& to,
                     const Renumbering& numbers, const std::vector<char>& is_changed);

  std::size_t new_count() const { return to_.bodies().size(); }
  /// The new index of a body; -1 if it is gone, or changed.
  std::int32_t operator[](std::int32_t old_body) const {
    const auto body = static_cast<std::size_t>(old_body);
    return body < new_index_.size() ? new_index_[body] : -1;
  }
  const PrimitiveIndices::OfBody& old_primitives(std::int32_t old_body) const {
    return from_.bodies()[static_cast<std::size_t>(old_body)];
  }
  const PrimitiveIndices::OfBody& new_primitives(std::int32_t new_body) const {
    return to_.bodies()[static_cast<std::size_t>(new_body)];
  }
  /// Gives a contact its new indices. Returns false if one of its bodies is gone or changed. The
  /// order of contacts stays.
  bool renumber(Contact& contact) const;

 private:
  const PrimitiveIndices &from_, &to_;
  std::vector<std::int32_t> new_index_;  // by old body
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
