// The rows of a step in the order of their contacts, those of a pair beside each other. Of what is
// only near most never acts, so such a row is made when it is first asked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Pairs that come near each other, sorted, and what is to be expected of each.
struct SpeculativePairs {
  Span<const Contact> contacts;
  Span<SpeculativeContact> speculative;  // by contact
};

class RowList {
 public:
  RowList() = default;
  explicit RowList(std::vector<ContactRow> rows) { take(rows); }

  void clear();
  // Takes these, all made, in place of what there was, and gives back memory.
  void take(std::vector<ContactRow>& rows);
  // Takes what is near, none of it made. The pairs are to stay as they are for as long as rows are
  // asked for that are not made.
  void take(const SpeculativePairs& near, const RowFactory& factory);

  std::size_t size() const { return place_.size(); }
  bool is_made(std::size_t i) const { return place_[i] >= 0; }
  const Contact& contact(std::size_t i) const {
    return is_made(i) ? made_[place_[i]].contact : near_.contacts[i];
  }
  bool is_movable(std::size_t i) const {
    return is_made(i) ? made_[place_[i]].is_movable : near_.speculative[i].is_movable;
  }
  // Of one that is not made.
  const SpeculativeContact& speculative(std::size_t i) const { return near_.speculative[i]; }
  // The first from `first` on whose contact does not come before this one; size(), where all do.
  // Soon where it is near.
  std::size_t find(const Contact& contact, std::size_t first) const;
  // Appends a row to others, made where it is not.
  void copy(std::size_t i, std::vector<ContactRow>& to) const;
  // Makes it, where it is not. It stays where it is until the list takes others.
  ContactRow& operator[](std::size_t i) {
    if (!is_made(i)) make(i);
    return made_[place_[i]];
  }

 private:
  void make(std::size_t i);
  void make(std::size_t i, ContactRow& row) const;

  std::vector<std::int32_t> place_;  // in made_; negative: not there
  std::vector<ContactRow> made_;
  SpeculativePairs near_;
  std::optional<RowFactory> factory_;  // of the rows that are not made
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
