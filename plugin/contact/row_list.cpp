#include "contact/row_list.h"

#include <algorithm>
#include <utility>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

RowList::RowList(std::vector<ContactRow> rows) : made_(std::move(rows)), made_count_(made_.size()) {
  LAZYCCD_ASSERT(are_in_order(made_), "rows of a list are in the order of their contacts");
  for (std::size_t i = 0; i < made_count_; ++i)
    entries_.push_back({-1, static_cast<std::int32_t>(i), false});
}

void RowList::clear() {
  entries_.clear();
  made_count_ = 0;
  near_ = {};
  factory_.reset();
}

void RowList::take(const NearContacts& near, const RowFactory& factory) {
  LAZYCCD_ASSERT(near.contacts.size() == near.estimates.size(),
                 "each near contact has an estimate");
  LAZYCCD_ASSERT(std::is_sorted(near.contacts.begin(), near.contacts.end()),
                 "near contacts of a list are in order");
  near_ = near;
  factory_ = factory;
  entries_.resize(near.contacts.size());
  for (std::size_t i = 0; i < entries_.size(); ++i)
    entries_[i] = {static_cast<std::int32_t>(i), -1, false};
  made_count_ = 0;
  if (made_.capacity() < size()) made_.clear();  // no copies of old rows
  reserve(size());
}

void RowList::reserve(std::size_t rows) {
  if (made_.capacity() < rows)
    made_.reserve(std::max(rows, made_.capacity() + made_.capacity() / 2));
}

void RowList::make(std::size_t i, ContactRow& row) const {
  factory_->make(near_.contacts[entries_[i].near], row);
  row.can_act = estimate(i).can_act;
  // Not where a contact comes near later: the normal is that of the time of impact, and what turns
  // may start beyond the half-space of the row.
  LAZYCCD_ASSERT(row.contact.toi > 0 || start_satisfies(row, factory_->motion()),
                 "the start of the step satisfies the row of what is near then");
}

bool RowList::have_one_sign(std::size_t first) const {
  for (std::size_t i = first; i < size(); ++i)
    if (!bullet::have_one_sign(made(i), made(size() - 1))) return false;
  return true;
}

std::size_t RowList::find(const Contact& contact, std::size_t first) const {
  const auto is_before = [&](std::size_t i) { return this->contact(i) < contact; };
  std::size_t step = 1, last = first;
  while (last < size() && is_before(last)) {
    first = last + 1;
    last += step;
    step *= 2;
  }
  last = std::min(last, size());
  while (first < last) {
    const std::size_t middle = first + (last - first) / 2;
    if (is_before(middle)) {
      first = middle + 1;
    } else {
      last = middle;
    }
  }
  return first;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
