// Contacts that bind the same points. Where a vertex lies above a vertex, every face and edge of
// the one is near every face and edge of the other, and all these pairs say what one of them says.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// What a contact binds: the same where the weights are on the same vertices, alike to 1/16, and the
// normals are alike to 1/4.
struct ContactKey {
  // Of one pair of primitives alone: all four vertices bear it.
  enum Kind : std::uint8_t { none, of_one, of_some } kind = none;
  std::uint32_t hash;  // of `points`
  // Three vertices, their rounded weights and the rounded normal.
  std::array<std::uint64_t, 3> points;
};

// In its place: to copy one that has just been made takes longer than to make it.
void make_contact_key(const Contact& contact, ContactKey& key);

// What is looked at of a contact to tell whether it is kept.
struct ReductionEntry {
  ContactKey key;  // where that is nothing it goes
  double gap = 0;   // metres, between its points where the step begins
};

// Buffers persist between steps.
class ContactReduction {
 public:
  // Of those that bind the same, the nearest is kept, and of equally near ones the first: the bonds
  // of the others bind nothing any more.
  void reduce(std::vector<ReductionEntry>& entries);

 private:
  std::vector<std::int32_t> table_;  // by hash of what is bound: the nearest contact, or -1
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
