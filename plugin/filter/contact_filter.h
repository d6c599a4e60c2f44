// Decides what becomes of a contact: whether the response acts on it, or why it does not.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "contact/pair_surfaces.h"
#include "filter/anchors.h"
#include "filter/seams.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "motion/parts_inside.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"
#include "untangling/untangling.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactFilter {
 public:
  /// Keeps references: the arguments must outlive the filter.
  ContactFilter(const SoftScene& scene, const StepTopology& topology, const Motion& motion,
                const PairSurfaces& surfaces, const Untangling& untangling)
      : scene_(scene),
        topology_(topology),
        motion_(motion),
        surfaces_(surfaces),
        untangling_(untangling) {}

  /// Reads Bullet's anchors. Call in each step, before contacts are asked for, and when indices of
  /// vertices change.
  void read_anchors() { anchors_.read(scene_); }
  /// Call when indices of bodies or vertices change, with the start of a motion.
  void set_topology();
  /// Sets what counts as anchored to obstacles that it is inside of, sorted. `pinned`: what of it
  /// is pinned.
  void set_embedded(PartsInside embedded, PartsInside pinned) {
    embedded_ = std::move(embedded);
    pinned_ = std::move(pinned);
  }
  /// Sets which bodies rest, by body; empty: none. Must stay valid until the next call.
  void set_at_rest(Span<const char> at_rest) { at_rest_ = at_rest; }

  // The end of the motion is that of Bullet's prediction, then it changes, then it is final.
  /// Marks the motion as new: its end is the one that Bullet predicted.
  void begin_motion();
  /// Call before the response changes the end of the motion. From then on the end that Bullet
  /// predicted is in Motion::predicted only.
  void begin_response() { stage_ = Stage::response; }
  /// Call when the end of the motion is final. What the response has stopped does not count then.
  void end_response() {
    if (stage_ == Stage::response) stage_ = Stage::final_motion;
  }

  enum class Verdict : std::uint8_t {
    act,          ///< the response acts on the contact
    rest,         ///< both bodies rest: it acts only if they touch
    pass,         ///< both are moved apart, and what touches there may pass
    report_only,  ///< the response cannot act on it, or a body has no contact response
    ignore        ///< no contact: an anchor holds both together, or a closed seam joins them
  };
  /// Decides about a contact in the current motion. Call it from any thread.
  Verdict verdict(const Contact& contact) const;
  /// True if the response could act on the contact, whatever rests or is moved apart.
  bool can_respond(const Contact& contact) const {
    return !is_joined(contact) && bodies_respond(contact) && has_response(contact);
  }
  /// False if one of the bodies has no contact response (CF_NO_CONTACT_RESPONSE).
  bool bodies_respond(const Contact& contact) const;

  /// Sets `vertices` to the vertices of the soft body that anchors hold to the obstacle, sorted.
  /// What is embedded counts as anchored.
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
  enum class Stage : std::uint8_t { prediction, response, final_motion };

  /// True if an anchor or a closed seam joins what touches.
  bool is_joined(const Contact& contact) const;
  /// True if the response can act on the contact. Pinned nodes with a prescribed motion stop before
  /// they pass through an obstacle. A kinematic body passes over pinned nodes, unless the response
  /// has already stopped a vertex of the pair.
  bool has_response(const Contact& contact) const;
  bool is_movable(std::int32_t vertex) const;
  void find_closed_seams();
  bool are_anchored(std::int32_t body_a, std::int32_t body_b, Span<const std::int32_t> vertices,
                    const PartsInside& embedded) const;

  const SoftScene& scene_;
  const StepTopology& topology_;
  const Motion& motion_;
  const PairSurfaces& surfaces_;
  const Untangling& untangling_;
  Anchors anchors_;
  Seams seams_;
  PartsInside embedded_, pinned_;
  Span<const char> at_rest_;
  Stage stage_ = Stage::prediction;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
