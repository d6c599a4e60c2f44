// The rows of a step, sorted by contact, so that the rows of a pair are adjacent. Most speculative
// contacts never act, so their rows are made only on first use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Speculative contacts of the step, sorted, with the quantities that decide whether each will act.
struct SpeculativePairs {
  Span<const Contact> contacts;
  Span<SpeculativeContact> speculative;  ///< same indices as `contacts`
};

/// Sorted list of rows that are made on demand. A row that is not made yet carries no impulse.
class RowList {
 public:
  RowList() = default;
  explicit RowList(std::vector<ContactRow> rows) { take(rows); }

  void clear();
  /// Replaces the list by these rows, which are all made. Leaves the old storage in `rows`, for
  /// reuse.
  void take(std::vector<ContactRow>& rows);
  /// Replaces the list by speculative contacts; no row is made yet. The arrays behind `pairs` must
  /// stay unchanged as long as the list may make rows of them.
  void take(const SpeculativePairs& pairs, const RowFactory& factory);

  std::size_t size() const { return made_index_.size(); }
  bool is_made(std::size_t i) const { return made_index_[i] >= 0; }
  const Contact& contact(std::size_t i) const {
    return is_made(i) ? made_[made_index_[i]].contact : pairs_.contacts[i];
  }
  bool is_movable(std::size_t i) const {
    return is_made(i) ? made_[made_index_[i]].is_movable : pairs_.speculative[i].is_movable;
  }
  /// Returns the speculative contact of a row that is not made.
  const SpeculativeContact& speculative(std::size_t i) const { return pairs_.speculative[i]; }
  /// Index of the first row at or after `first` whose contact is not before `contact`; size() if
  /// there is none. Takes time logarithmic in the distance from `first`.
  std::size_t find(const Contact& contact, std::size_t first) const;
  /// Appends a copy of row `i` to `to`; makes the copy if the row is not made.
  void copy(std::size_t i, std::vector<ContactRow>& to) const;
  /// Returns row `i`; makes it if needed. The reference stays valid until the list is replaced.
  ContactRow& operator[](std::size_t i) {
    if (!is_made(i)) make(i);
    return made_[made_index_[i]];
  }

 private:
  void make(std::size_t i);
  void make(std::size_t i, ContactRow& row) const;

  std::vector<std::int32_t> made_index_;  // index in made_; negative: not made
  std::vector<ContactRow> made_;
  SpeculativePairs pairs_;
  std::optional<RowFactory> factory_;  // makes the missing rows
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
