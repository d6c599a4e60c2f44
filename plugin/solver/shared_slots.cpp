#include "solver/shared_slots.h"

namespace lazyccd::bullet {
namespace {

// Slots of a grain.
constexpr std::size_t grain_size = 256;

}  // namespace

void SharedSlots::build(Span<const RowBlock> blocks, std::vector<std::int32_t>& scratch) {
  grains_.clear();
  slots_.clear();
  first_.assign(1, 0);
  // Numbers of copies first, one place further, then their ends.
  for (const RowBlock& block : blocks) {
    for (const std::int32_t slot : block.shared) {
      std::int32_t& number = scratch[static_cast<std::size_t>(slot)];
      if (number == 0) {
        if (grains_.empty() || grains_.back().island != block.island ||
            grains_.back().last - grains_.back().first == grain_size)
          grains_.push_back({block.island, slots_.size(), slots_.size()});
        ++grains_.back().last;
        slots_.push_back(slot);
        first_.push_back(0);
        number = static_cast<std::int32_t>(slots_.size());
      }
      ++first_[static_cast<std::size_t>(number)];
    }
  }
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  copies_.resize(first_.back());
  for (std::size_t b = blocks.size(); b-- > 0;) {
    const RowBlock& block = blocks[b];
    for (std::size_t j = block.shared.size(); j-- > 0;) {
      const auto number =
          static_cast<std::size_t>(scratch[static_cast<std::size_t>(block.shared[j])]);
      copies_[--first_[number]] = block.copy(j);
    }
  }
  // first_[number] is now the first copy of slot number - 1.
  first_.erase(first_.begin());
  first_.push_back(copies_.size());
  for (const std::int32_t slot : slots_) scratch[static_cast<std::size_t>(slot)] = 0;
}

}  // namespace lazyccd::bullet
