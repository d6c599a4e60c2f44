// Finds near contacts that lie behind others. Where margins reach over several layers, as between
// the pages of a book, each vertex is near all of them. The row of its contact with the first page
// keeps it on its side of a plane, and the second page lies behind that plane. So the contact with
// the second page needs no row.
//
// A contact of a vertex hides a farther one of the same vertex if the point of the farther one lies
// behind the plane of the nearer one. That plane goes through its point, across its normal. The
// point has to lie there at the start and at the end of the step, and clearly: contacts with
// neighbours in a flat surface would come and go with rounding. The same holds for contacts that
// have a face or an edge of the same index. There, the depth behind the plane must exceed the
// distance of their points on it.
//
// What is left out is not certain to stay apart. If it touches in the motion that the response
// makes, the next detection finds it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "contact/near_contacts.h"
#include "detection/contact_reduction.h"
#include "detection/parallel_lists.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Keeps its buffers between steps.
class HiddenContacts {
 public:
  /// Whether two bodies stop each other. A body also asks for itself.
  using StopEachOther = std::function<bool(std::int32_t a, std::int32_t b)>;

  explicit HiddenContacts(StopEachOther stop_each_other)
      : stop_each_other_(std::move(stop_each_other)) {}

  /// Sets the kind of contacts that others hide to ConstraintKey::none. Those that have it, or
  /// cannot act, hide nothing. `entries`: one for each of the contacts.
  void drop(const NearContacts& near, const Motion& motion, const Threads& threads,
            std::vector<ReductionEntry>& entries);

 private:
  /// A contact as one of its two primitives has it: 2 * contact for a, 2 * contact + 1 for b.
  using Side = std::int32_t;

  using SideByGap = std::pair<double, Side>;  // gap in metres, as in ReductionEntry

  /// The contact points at the start and at the end of the step, metres.
  struct Points {
    std::array<Vector3d, 2> a, b;
  };

  /// What a call of drop() works on.
  struct Input {
    const NearContacts& near;
    const Motion& motion;
    const Threads& threads;
    const std::vector<ReductionEntry>& entries;

    const Contact& contact_of(Side side) const {
      return near.contacts[static_cast<std::size_t>(side / 2)];
    }
  };

  /// Calls each(i) for each contact, on several threads.
  template <class Each>
  static void for_each_contact(const Input& input, const Each& each);
  /// Makes the lists of the primitives of soft bodies.
  void make_lists(const Input& input);
  /// Sets points_ and is_listed_. Returns whether any primitive has several contacts.
  bool find_points(const Input& input);
  static Points points_of(const Contact& contact, const Motion& motion);
  /// Looks through the lists with several contacts: those of vertices, or all others.
  void find_hidden(const Input& input, bool of_vertices);
  /// Marks the contacts in the list from this side on that others of them hide. Contacts of
  /// vertices that are hidden already take no part. `list`: scratch memory.
  void find_hidden(const Input& input, Side first, std::vector<SideByGap>& list);
  bool hides(const Input& input, Side nearer, Side farther) const;

  StopEachOther stop_each_other_;
  ParallelLists lists_;                          // of sides, by primitive
  bool are_empty_ = true;                        // false: a failure has left lists
  std::vector<std::vector<SideByGap>> scratch_;  // by part of the contacts
  std::vector<std::uint8_t> is_listed_;  // by contact: whether one of its primitives has others
  std::vector<Points> points_;           // by contact, if so
  std::vector<std::uint8_t> hidden_;     // by side: whether the contact is hidden, seen from there
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
