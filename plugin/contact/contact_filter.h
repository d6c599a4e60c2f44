// Decides which contacts of a step get a response.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "contact/pair_surfaces.h"
#include "contact/seams.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "motion/parts_inside.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactFilter {
 public:
  /// Keeps references: the arguments must outlive the filter.
  ContactFilter(const SoftScene& scene, const StepTopology& topology, const Motion& motion,
                const PairSurfaces& surfaces)
      : scene_(scene), topology_(topology), motion_(motion), surfaces_(surfaces) {}

  /// Reads Bullet's anchors. Call in each step, before contacts are asked for, and when indices of
  /// vertices change.
  void read_anchors();
  /// Call when indices of bodies or vertices change, with the start of a motion.
  void set_topology();
  /// Sets what counts as anchored to obstacles that it is inside of, sorted. `pinned`: what of it
  /// is pinned.
  void set_embedded(PartsInside embedded, PartsInside pinned) {
    embedded_ = std::move(embedded);
    pinned_ = std::move(pinned);
  }
  /// Marks the motion as new: its end is the one that Bullet predicted.
  void begin_motion();
  /// Call with true before the response changes the end of the motion. From then on the end that
  /// Bullet predicted is in Motion::predicted only.
  void set_end_changed(bool end_changed) { end_changed_ = end_changed; }

  enum class Decision : std::uint8_t {
    respond,      ///< the response acts on the contact
    report_only,  ///< the response does not act on the contact: it is only reported
    ignore        ///< no contact: an anchor holds both together, or a closed seam joins them
  };
  /// Decides what happens to a contact in the current motion.
  Decision decide(const Contact& contact) const;

  /// False if one of the bodies has no contact response (CF_NO_CONTACT_RESPONSE).
  bool bodies_respond(const Contact& contact) const;
  /// Same as has_response(), but for the motion as Bullet predicted it. Ignores what the response
  /// has changed so far.
  bool has_response_as_predicted(const Contact& contact) const;
  /// True if an anchor holds a node of the soft body to the rigid body of the contact. What is
  /// embedded counts as anchored, here and below.
  bool is_anchored(const Contact& contact) const {
    return are_anchored(contact.body_a, contact.body_b,
                        {contact.vertices.data(), contact.vertices.size()}, embedded_);
  }
  /// Sets `vertices` to the vertices of the soft body that anchors hold to the obstacle, sorted.
  void find_anchored(std::int32_t soft_body, std::int32_t obstacle,
                     std::vector<std::int32_t>& vertices) const;

  /// True if the primitive of a soft body, or a part of it, is embedded in the obstacle.
  bool is_embedded(Span<const std::int32_t> primitive, std::int32_t obstacle) const {
    return embedded_.contains(primitive, obstacle);
  }
  /// True if edges or faces are embedded whose vertices are not.
  bool any_embedded_edges() const { return !embedded_.edges.empty() || !embedded_.faces.empty(); }

  // For what may be moved apart. Of what is embedded only pinned vertices count as anchored here.
  /// True if an anchor holds a soft vertex to the rigid body of this index.
  bool is_anchored(std::int32_t soft_vertex, std::int32_t body) const {
    return are_anchored(topology_.body_of(soft_vertex), body, {&soft_vertex, 1}, pinned_);
  }
  /// True if an anchor holds the edge and the face together, or a closed seam joins them.
  bool ignores(const Edge& edge, const Face& face) const;

 private:
  /// True if the response can act on the contact. Pinned nodes with a prescribed motion stop before
  /// they pass through an obstacle. A kinematic body passes over pinned nodes, unless the response
  /// has already stopped a vertex of the pair.
  bool has_response(const Contact& contact) const;
  bool is_movable(std::int32_t vertex) const;
  void find_closed_seams();
  /// True if an anchor of Bullet holds the soft vertex to the object.
  bool holds(std::int32_t soft_vertex, const btCollisionObject* object) const;
  /// The first anchor of this vertex or a later one, in anchors_.
  std::size_t first_anchor(std::int32_t vertex) const;
  bool are_anchored(std::int32_t body_a, std::int32_t body_b, Span<const std::int32_t> vertices,
                    const PartsInside& embedded) const;

  struct Anchor {
    std::int32_t vertex;
    const btCollisionObject* object;
  };

  const SoftScene& scene_;
  const StepTopology& topology_;
  const Motion& motion_;
  const PairSurfaces& surfaces_;
  std::vector<Anchor> anchors_;  // sorted by vertex
  Seams seams_;
  PartsInside embedded_, pinned_;
  bool end_changed_ = false;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
