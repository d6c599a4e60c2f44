// Decides which contacts of a step get a response.
#pragma once

#include <array>
#include <cstdint>

#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactFilter {
 public:
  // What it reads of a step must outlive it.
  ContactFilter(const SoftScene& scene, const StepTopology& topology, const Motion& motion)
      : scene_(scene), topology_(topology), motion_(motion) {}

  // To be called for a new motion; and once a contact of it is answered: from then on the motion's
  // end may differ from Bullet's, which is in Motion::predicted.
  void begin_motion() { has_answered_ = false; }
  void set_answered(bool has_answered) { has_answered_ = has_answered; }

  enum class Answer : std::uint8_t {
    given,     // the response acts on it
    none,      // nothing can be done about it: it is only reported
    not_asked  // no contact: an anchor holds the two together
  };
  Answer answer_to(const Contact& contact) const;

  // False: the bodies have no contact response (CF_NO_CONTACT_RESPONSE).
  bool responds(const Contact& contact) const;
  // The same as may_be_ended(), of the motion as Bullet had it.
  bool could_be_ended(const Contact& contact) const;
  // An anchor holds a node of the one to the other's rigid body.
  bool is_anchored(const Contact& contact) const {
    return are_anchored(contact.body_a, contact.body_b,
                        {contact.vertices.data(), contact.vertices.size()});
  }
  bool are_anchored(const Edge& edge, const Face& face) const {
    const std::array<std::int32_t, 5> vertices = {edge[0], edge[1], face[0], face[1], face[2]};
    return are_anchored(topology_.body_of(edge[0]), topology_.body_of(face[0]),
                        {vertices.data(), vertices.size()});
  }

 private:
  // Pinned nodes that are driven stop before what they would pass through. A kinematic body passes
  // over pinned nodes, unless something of the pair has been stopped.
  bool may_be_ended(const Contact& contact) const;
  bool is_movable(std::int32_t vertex) const;
  bool are_anchored(std::int32_t body_a, std::int32_t body_b,
                    Span<const std::int32_t> vertices) const;

  const SoftScene& scene_;
  const StepTopology& topology_;
  const Motion& motion_;
  bool has_answered_ = false;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
