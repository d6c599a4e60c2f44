#include "response/row_batches.h"

#include <algorithm>

namespace lazyccd::bullet {

void RowBatches::begin(std::size_t slots) {
  open_groups_with_.assign(slots, 0);
  for (OpenGroup& open : open_groups_) open.count = open.slot_count = 0;
  oldest_ = 0;
  groups_.clear();
}

void RowBatches::add(std::int32_t row, const std::int32_t* first_slot,
                     const std::int32_t* last_slot) {
  unsigned used = 0;
  for (const std::int32_t* slot = first_slot; slot != last_slot; ++slot)
    used |= open_groups_with_[*slot];
  int i = 0;
  while (i < max_open_groups && (used >> i & 1)) ++i;
  if (i == max_open_groups) {
    i = oldest_;
    oldest_ = (oldest_ + 1) % max_open_groups;
    close(i);
  }
  OpenGroup& open = open_groups_[i];
  open.rows[open.count++] = row;
  for (const std::int32_t* slot = first_slot; slot != last_slot; ++slot) {
    open.slots[open.slot_count++] = *slot;
    open_groups_with_[*slot] = static_cast<std::uint8_t>(open_groups_with_[*slot] | 1u << i);
  }
  if (open.count == RowBatch::rows) close(i);
}

void RowBatches::close(int i) {
  OpenGroup& open = open_groups_[i];
  if (open.count == 0) return;
  std::fill(open.rows.begin() + open.count, open.rows.end(), none);
  groups_.push_back(open.rows);
  for (int k = 0; k < open.slot_count; ++k) {
    std::uint8_t& groups = open_groups_with_[open.slots[k]];
    groups = static_cast<std::uint8_t>(groups & ~(1u << i));
  }
  open.count = open.slot_count = 0;
}

void RowBatches::finish() {
  for (int i = 0; i < max_open_groups; ++i) close(i);
}

}  // namespace lazyccd::bullet
