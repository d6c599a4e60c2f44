// The rows of a step, sorted by contact, so that the rows of a pair are adjacent. Most near
// contacts never act, so their rows are made only on first use.
#pragma once

#include <algorithm>
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
/// References to rows stay valid until rows are added or the list is replaced.
class RowList {
 public:
  RowList() = default;
  /// These rows, which are in order.
  explicit RowList(std::vector<ContactRow> rows);

  void clear();
  /// Replaces the list by near contacts; no row is made yet. The arrays behind `near` must stay
  /// unchanged as long as the list may make rows of them.
  void take(const NearContacts& near, const RowFactory& factory);
  /// Adds a row for each of the contacts, which are sorted: make(contact, row) makes it. It comes
  /// behind the rows that its pair has. Of those only made ones with an impulse stay. Other rows
  /// are dropped if they cannot act and are not made. So indices change.
  template <class Make>
  void add(Span<const Contact> contacts, const Make& make);

  std::size_t size() const { return entries_.size(); }
  bool is_made(std::size_t i) const { return entries_[i].made >= 0; }
  const Contact& contact(std::size_t i) const {
    return is_made(i) ? made_[entries_[i].made].contact : near_.contacts[entries_[i].near];
  }
  bool can_act(std::size_t i) const { return is_made(i) ? made(i).can_act : estimate(i).can_act; }
  /// Returns the estimate of a row that is not made.
  const RowEstimate& estimate(std::size_t i) const { return near_.estimates[entries_[i].near]; }
  /// Index of the first row at or after `first` whose contact is not before `contact`; size() if
  /// there is none. Takes time logarithmic in the distance from `first`.
  std::size_t find(const Contact& contact, std::size_t first) const;
  /// Returns row `i`; makes it if needed.
  ContactRow& operator[](std::size_t i) {
    if (!is_made(i)) {
      place(i);
      make_placed(i);
    }
    return made_[entries_[i].made];
  }
  /// Whether the row may need a split impulse.
  bool may_need_split(std::size_t i) const { return entries_[i].may_need_split; }
  /// Several threads may do this for different rows.
  void set_may_need_split(std::size_t i, bool may) { entries_[i].may_need_split = may; }
  /// Returns row `i`, which is made.
  const ContactRow& made(std::size_t i) const {
    LAZYCCD_ASSERT(is_made(i), "a row that is read as made is made");
    return made_[entries_[i].made];
  }
  /// Returns row `i`: that of the list, or `scratch`, made, if the list has not made it. Changes
  /// nothing in the list, so several threads may call it.
  const ContactRow& get(std::size_t i, ContactRow& scratch) const {
    if (is_made(i)) return made_[entries_[i].made];
    make(i, scratch);
    return scratch;
  }
  /// Returns the place of row `i`, which is not made. The row counts as made from now on, and must
  /// be made by make_placed() before anything else reads it.
  ContactRow& place(std::size_t i) {
    LAZYCCD_ASSERT(!is_made(i), "a row gets one place");
    return made_[entries_[i].made = next_place()];
  }
  /// Makes a row at its place(). Several threads may make different rows at the same time.
  void make_placed(std::size_t i) { make(i, made_[entries_[i].made]); }

 private:
  struct Entry {
    std::int32_t near, made;  // index in near_; in made_, or negative
    bool may_need_split;
  };

  void make(std::size_t i, ContactRow& row) const;
  /// For assertions: of the made rows from this one to the last.
  bool have_one_sign(std::size_t first) const;
  /// Makes room for so many made rows.
  void reserve(std::size_t rows);
  /// The index of the next made row.
  std::int32_t next_place() {
    if (made_count_ == made_.size()) made_.emplace_back();
    return static_cast<std::int32_t>(made_count_++);
  }

  std::vector<Entry> entries_, last_entries_;  // the second: scratch memory of add()
  std::vector<ContactRow> made_;               // then rows of earlier steps, kept for their memory
  std::size_t made_count_ = 0;
  NearContacts near_;
  std::optional<RowFactory> factory_;  // makes the missing rows
};

template <class Make>
void RowList::add(Span<const Contact> contacts, const Make& make) {
  LAZYCCD_ASSERT(std::is_sorted(contacts.begin(), contacts.end()),
                 "contacts that become rows are in order");
  reserve(made_count_ + size() + contacts.size());
  last_entries_.swap(entries_);
  entries_.clear();
  auto old = last_entries_.begin();
  const auto contact_of_old = [&]() -> const Contact& {
    return old->made >= 0 ? made_[old->made].contact : near_.contacts[old->near];
  };
  const auto keep_before = [&](const Contact* contact) {
    for (; old != last_entries_.end() && (!contact || contact_of_old() < *contact); ++old)
      if (old->made >= 0 || near_.estimates[old->near].can_act) entries_.push_back(*old);
  };
  for (const Contact& contact : contacts) {
    keep_before(&contact);
    const std::size_t first_of_pair = size();
    for (; old != last_entries_.end() && !(contact < contact_of_old()); ++old)
      if (old->made >= 0 && (made_[old->made].has_impulse() || made_[old->made].split_impulse > 0))
        entries_.push_back(*old);
    entries_.push_back({-1, next_place(), false});
    make(contact, made_[entries_.back().made]);
    LAZYCCD_ASSERT(have_one_sign(first_of_pair),
                   "rows of a pair that is in contact at the start have one sign");
  }
  keep_before(nullptr);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
