// Islands: bodies that are connected by contacts or anchors. Static and kinematic bodies connect
// nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A dynamic rigid body, or soft vertices of one body.
struct MassRange {
  int rigid;                 ///< as in Motion::rigid; -1: soft vertices
  bool is_carrier;           ///< a body that only anchors connect to the island
  std::int32_t first, last;  ///< the vertices
};

/// A group of bodies that are in contact with each other, directly or through others. The spans are
/// valid until the next Islands::find().
struct Island {
  Span<const std::int32_t> bodies;
  Span<const int> articulated;  ///< multibodies with a link in it, as in Motion::articulated
  Span<const MassRange> masses;
  /// Parts of about a thousand masses each: where each begins in `masses`; then where they end.
  Span<const std::size_t> parts;
  bool free = true;  ///< nothing has infinite mass, locked axes, joints or supports
  /// Speed of the fastest vertex of infinite mass that was not stopped, m/s.
  double prescribed_speed = 0;

  /// Adds a body with vertices of infinite mass, of which the fastest has this speed; none: it has
  /// no such vertex.
  void add_fixed(std::optional<double> speed);
};

/// The islands of a step. Keeps its memory from step to step.
class Islands {
 public:
  /// Finds the islands that these rows and the anchors make. Bodies without a contact are in none,
  /// but for those in `others`.
  void find(const std::vector<const ContactRow*>& rows, const std::vector<std::int32_t>& others,
            const Motion& motion);

  Span<const Island> all() const { return islands_; }

 private:
  void join_contacts(const std::vector<const ContactRow*>& rows, const Motion& motion);
  void join_anchored(const Motion& motion);
  /// Sets islands_, island_of_ and bodies_, in order of the islands.
  void number_islands();
  void add_bodies(const Motion& motion);
  /// Static and kinematic bodies are a part of each island that they meet.
  void add_fixed(const std::vector<const ContactRow*>& rows, const Motion& motion);
  /// `first_articulated`: where those of the island begin in articulated_.
  void add_body(std::int32_t body, std::size_t first_articulated, const Motion& motion,
                Island& island);
  /// Adds the masses of an island, in parts.
  void add_masses(Span<const std::int32_t> bodies, const Motion& motion);

  // Where the data of an island begin in the arrays below.
  struct Begin {
    std::size_t body = 0, articulated = 0, mass = 0, part = 0;
  };
  // The fastest vertex of a static or kinematic body.
  struct Fixed {
    bool is_known = false;
    std::optional<double> speed;  // m/s
  };

  std::vector<Island> islands_;
  DisjointSets sets_{0};
  // By body.
  std::vector<char> in_contact_, is_carrier_;
  std::vector<std::int32_t> island_of_;  // -1: none
  std::vector<Fixed> fixed_;
  std::vector<std::int32_t> body_of_rigid_;  // by index in Motion::rigid
  // What the spans of the islands see, island by island.
  std::vector<std::int32_t> bodies_;
  std::vector<int> articulated_;
  std::vector<MassRange> masses_;
  std::vector<std::size_t> parts_;
  std::vector<Begin> begin_;  // by island; then where the last one ends
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
