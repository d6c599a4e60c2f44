// The rows of a step, sorted by contact, so that the rows of a pair are adjacent. Most near
// contacts never act, so their rows are made only on first use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "contact/contact_row.h"
#include "contact/near_contacts.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Sorted list of rows that are made on demand. A row that is not made yet carries no impulse.
class RowList {
 public:
  RowList() = default;
  explicit RowList(std::vector<ContactRow> rows) { take(rows); }

  void clear();
  /// Replaces the list by these rows, which are all made. Leaves the old storage in `rows`, for
  /// reuse.
  void take(std::vector<ContactRow>& rows);
  /// Replaces the list by near contacts; no row is made yet. The arrays behind `near` must stay
  /// unchanged as long as the list may make rows of them.
  void take(const NearContacts& near, const RowFactory& factory);

  std::size_t size() const { return made_index_.size(); }
  bool is_made(std::size_t i) const { return made_index_[i] >= 0; }
  const Contact& contact(std::size_t i) const {
    return is_made(i) ? made_[made_index_[i]].contact : near_.contacts[i];
  }
  bool can_act(std::size_t i) const {
    return is_made(i) ? made_[made_index_[i]].can_act : near_.estimates[i].can_act;
  }
  /// Returns the estimate of a row that is not made.
  const RowEstimate& estimate(std::size_t i) const { return near_.estimates[i]; }
  /// Index of the first row at or after `first` whose contact is not before `contact`; size() if
  /// there is none. Takes time logarithmic in the distance from `first`.
  std::size_t find(const Contact& contact, std::size_t first) const;
  /// Appends a copy of row `i` to `to`; makes the copy if the row is not made.
  void copy(std::size_t i, std::vector<ContactRow>& to) const;
  /// Returns row `i`; makes it if needed. The reference stays valid until the list is replaced.
  ContactRow& operator[](std::size_t i) {
    if (!is_made(i)) {
      place(i);
      make_placed(i);
    }
    return made_[made_index_[i]];
  }
  /// Whether the row may need a split impulse.
  bool may_need_split(std::size_t i) const { return may_need_split_[i] != 0; }
  /// Several threads may do this for different rows.
  void set_may_need_split(std::size_t i, bool may) { may_need_split_[i] = may; }
  /// Returns row `i`, which is made.
  const ContactRow& made(std::size_t i) const {
    LAZYCCD_ASSERT(is_made(i), "a row that is read as made is made");
    return made_[made_index_[i]];
  }
  /// Returns row `i`: that of the list, or `scratch`, made, if the list has not made it. Changes
  /// nothing in the list, so several threads may call it.
  const ContactRow& get(std::size_t i, ContactRow& scratch) const {
    if (is_made(i)) return made_[made_index_[i]];
    make(i, scratch);
    return scratch;
  }
  /// Returns the place of row `i`, which is not made. The row counts as made from now on, and must
  /// be made by make_placed() before anything else reads it.
  ContactRow& place(std::size_t i) {
    LAZYCCD_ASSERT(!is_made(i), "a row gets one place");
    made_index_[i] = static_cast<std::int32_t>(made_count_);
    if (made_count_ == made_.size()) made_.emplace_back();
    return made_[made_count_++];
  }
  /// Makes a row at its place(). Several threads may make different rows at the same time.
  void make_placed(std::size_t i) { make(i, made_[made_index_[i]]); }

 private:
  void make(std::size_t i, ContactRow& row) const;

  std::vector<std::int32_t> made_index_;  // index in made_; negative: not made
  std::vector<ContactRow> made_;          // then rows of earlier steps, kept for their memory
  std::size_t made_count_ = 0;
  std::vector<char> may_need_split_;
  NearContacts near_;
  std::optional<RowFactory> factory_;  // makes the missing rows
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
