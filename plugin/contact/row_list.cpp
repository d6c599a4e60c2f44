#include "contact/row_list.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void RowList::clear() {
  place_.clear();
  near_ = {};
  factory_.reset();
}

void RowList::take(std::vector<ContactRow>& rows) {
  clear();
  made_.swap(rows);
  place_.resize(made_.size());
  std::iota(place_.begin(), place_.end(), 0);
}

void RowList::take(const SpeculativePairs& near, const RowFactory& factory) {
  near_ = near;
  factory_ = factory;
  place_.assign(near.contacts.size(), -1);
  made_.clear();
  made_.reserve(place_.size());  // rows stay where they are
}

void RowList::make(std::size_t i) {
  place_[i] = static_cast<std::int32_t>(made_.size());
  make(i, made_.emplace_back());
}

void RowList::make(std::size_t i, ContactRow& row) const {
  factory_->make(near_.contacts[i], row);
  row.is_movable = near_.speculative[i].is_movable;
}

void RowList::copy(std::size_t i, std::vector<ContactRow>& to) const {
  if (is_made(i)) {
    to.push_back(made_[place_[i]]);
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
