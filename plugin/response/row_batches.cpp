#include "response/row_batches.h"

#include <algorithm>

namespace lazyccd::bullet {

void RowBatches::begin(std::size_t things) {
  open_with_.assign(things, 0);
  for (Open& open : open_) open.count = open.thing_count = 0;
  oldest_ = 0;
  groups_.clear();
}

void RowBatches::add(std::int32_t row, const std::int32_t* first_thing,
                       const std::int32_t* last_thing) {
  unsigned taken = 0;
  for (const std::int32_t* thing = first_thing; thing != last_thing; ++thing)
    taken |= open_with_[*thing];
  int i = 0;
  while (i < open_count && (taken >> i & 1)) ++i;
  if (i == open_count) {
    i = oldest_;
    oldest_ = (oldest_ + 1) % open_count;
    end(i);
  }
  Open& open = open_[i];
  open.rows[open.count++] = row;
  for (const std::int32_t* thing = first_thing; thing != last_thing; ++thing) {
    open.things[open.thing_count++] = *thing;
    open_with_[*thing] = static_cast<std::uint8_t>(open_with_[*thing] | 1u << i);
  }
  if (open.count == RowBatch::rows) end(i);
}

void RowBatches::end(int i) {
  Open& open = open_[i];
  if (open.count == 0) return;
  std::fill(open.rows.begin() + open.count, open.rows.end(), none);
  groups_.push_back(open.rows);
  for (int k = 0; k < open.thing_count; ++k) {
    std::uint8_t& open_with = open_with_[open.things[k]];
    open_with = static_cast<std::uint8_t>(open_with & ~(1u << i));
  }
  open.count = open.thing_count = 0;
}

void RowBatches::finish() {
  for (int i = 0; i < open_count; ++i) end(i);
}

}  // namespace lazyccd::bullet
