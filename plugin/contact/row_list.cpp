#include "contact/row_list.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void RowList::clear() {
  made_index_.clear();
  may_need_split_.clear();
  near_ = {};
  factory_.reset();
}

void RowList::take(std::vector<ContactRow>& rows) {
  LAZYCCD_ASSERT(are_in_order(rows), "rows of a list are in the order of their contacts");
  clear();
  made_.swap(rows);
  made_count_ = made_.size();
  made_index_.resize(made_count_);
  std::iota(made_index_.begin(), made_index_.end(), 0);
  may_need_split_.assign(made_count_, 0);
}

void RowList::take(const NearContacts& near, const RowFactory& factory) {
  LAZYCCD_ASSERT(near.contacts.size() == near.estimates.size(),
                 "each near contact has an estimate");
  LAZYCCD_ASSERT(std::is_sorted(near.contacts.begin(), near.contacts.end()),
                 "near contacts of a list are in order");
  near_ = near;
  factory_ = factory;
  made_index_.assign(near.contacts.size(), -1);
  may_need_split_.assign(near.contacts.size(), 0);
  made_count_ = 0;
  if (made_.capacity() < made_index_.size()) made_.clear();  // no copies of old rows
  made_.reserve(made_index_.size());                         // references to rows stay valid
}

void RowList::make(std::size_t i, ContactRow& row) const {
  factory_->make(near_.contacts[i], row);
  row.can_act = near_.estimates[i].can_act;
  // Not where a contact comes near later: the normal is that of the time of impact, and what turns
  // may start beyond the half-space of the row.
  LAZYCCD_ASSERT(row.contact.toi > 0 || start_satisfies(row, factory_->motion()),
                 "the start of the step satisfies the row of what is near then");
}

void RowList::copy(std::size_t i, std::vector<ContactRow>& to) const {
  if (is_made(i)) {
    to.push_back(made_[made_index_[i]]);
  } else {
    make(i, to.emplace_back());
  }
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
