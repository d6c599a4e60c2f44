#include "response/row_batches.h"

#include <algorithm>

namespace lazyccd::bullet {

void RowBatches::begin(std::size_t slots) {
  open_batches_with_.assign(slots, 0);
  for (OpenBatch& open : open_batches_) open.count = open.slot_count = 0;
  oldest_ = 0;
  batches_.clear();
}

void RowBatches::add(std::int32_t row, const std::int32_t* first_slot,
                     const std::int32_t* last_slot) {
  unsigned used = 0;
  for (const std::int32_t* slot = first_slot; slot != last_slot; ++slot)
    used |= open_batches_with_[*slot];
  int i = 0;
  while (i < max_open_batches && (used >> i & 1)) ++i;
  if (i == max_open_batches) {
    i = oldest_;
    oldest_ = (oldest_ + 1) % max_open_batches;
    close(i);
  }
  OpenBatch& open = open_batches_[i];
  open.rows[open.count++] = row;
  for (const std::int32_t* slot = first_slot; slot != last_slot; ++slot) {
    open.slots[open.slot_count++] = *slot;
    open_batches_with_[*slot] = static_cast<std::uint8_t>(open_batches_with_[*slot] | 1u << i);
  }
  if (open.count == RowBatch::lanes) close(i);
}

void RowBatches::close(int i) {
  OpenBatch& open = open_batches_[i];
  if (open.count == 0) return;
  std::fill(open.rows.begin() + open.count, open.rows.end(), none);
  batches_.push_back(open.rows);
  for (int k = 0; k < open.slot_count; ++k) {
    std::uint8_t& batches = open_batches_with_[open.slots[k]];
    batches = static_cast<std::uint8_t>(batches & ~(1u << i));
  }
  open.count = open.slot_count = 0;
}

void RowBatches::finish() {
  for (int i = 0; i < max_open_batches; ++i) close(i);
}

}  // namespace lazyccd::bullet
