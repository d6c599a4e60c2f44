#include "solver/row_batches.h"

#include <algorithm>
#include <numeric>

#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
namespace {

std::size_t count_rows(const std::vector<RowBatches::Batch>& batches) {
  std::size_t count = 0;
  for (const RowBatches::Batch& batch : batches)
    count += batch.size() -
             static_cast<std::size_t>(std::count(batch.begin(), batch.end(), RowBatches::none));
  return count;
}

}  // namespace

void RowBatches::begin(std::size_t slots) {
  if (taken_.size() < slots) taken_.resize(slots, 0);  // finish() has left no bits
  rows_.clear();
  batches_.clear();
  oldest_ = 0;
}

void RowBatches::add(std::int32_t row, const std::int32_t* first_slot,
                     const std::int32_t* last_slot) {
  LAZYCCD_ASSERT(last_slot - first_slot <= max_slots, "a row moves at most max_slots slots");
  Row& added = rows_.emplace_back();
  added.row = row;
  added.slot_count = static_cast<std::int32_t>(last_slot - first_slot);
  std::copy(first_slot, last_slot, added.slots.begin());
  std::uint64_t taken = 0;
  for (const std::int32_t* slot = first_slot; slot != last_slot; ++slot) taken |= taken_[*slot];
  added.layer = 0;
  while (added.layer < max_layers - 1 && (taken >> added.layer & 1)) ++added.layer;
  for (const std::int32_t* slot = first_slot; slot != last_slot; ++slot)
    taken_[*slot] |= std::uint64_t{1} << added.layer;
}

void RowBatches::finish() {
  // The rows layer by layer, each layer in the order of the rows.
  std::array<std::size_t, max_layers + 1> next = {};
  for (const Row& row : rows_) ++next[static_cast<std::size_t>(row.layer) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  order_.resize(rows_.size());
  for (const Row& row : rows_) order_[next[static_cast<std::size_t>(row.layer)]++] = &row;
  for (const Row* const row : order_) pack(*row);
  for (int i = 0; i < max_open_batches; ++i) close(i);
  LAZYCCD_ASSERT(count_rows(batches_) == rows_.size(), "each row is in one batch");
  for (const Row& row : rows_)
    for (std::int32_t k = 0; k < row.slot_count; ++k) taken_[row.slots[k]] = 0;
}

// Adds the row to the first open batch that moves none of its slots.
void RowBatches::pack(const Row& row) {
  const auto* const last = row.slots.begin() + row.slot_count;
  std::uint64_t taken = 0;
  for (const auto* slot = row.slots.begin(); slot != last; ++slot) taken |= taken_[*slot];
  taken >>= max_layers;
  int i = 0;
  while (i < max_open_batches && (taken >> i & 1)) ++i;
  if (i == max_open_batches) {
    i = oldest_;
    oldest_ = (oldest_ + 1) % max_open_batches;
    close(i);
  }
  OpenBatch& open = open_batches_[i];
  open.rows[open.count++] = row.row;
  for (const auto* slot = row.slots.begin(); slot != last; ++slot) {
    open.slots[open.slot_count++] = *slot;
    taken_[*slot] |= std::uint64_t{1} << (max_layers + i);
  }
  if (open.count == RowBatch::lanes) close(i);
}

void RowBatches::close(int i) {
  OpenBatch& open = open_batches_[i];
  if (open.count == 0) return;
  std::fill(open.rows.begin() + open.count, open.rows.end(), none);
  batches_.push_back(open.rows);
  for (int k = 0; k < open.slot_count; ++k)
    taken_[open.slots[k]] &= ~(std::uint64_t{1} << (max_layers + i));
  open.count = open.slot_count = 0;
}

}  // namespace lazyccd::bullet
