#include "gpu/lazy_stealing.cuh"

#include <algorithm>
#include <string>

#include "gpu/device_buffer.h"
#include "gpu/grid.h"
#include "gpu/traversal_strategy.h"
#include "lazyccd/error.h"

namespace lazyccd::gpu {
namespace {

std::uint32_t next_power_of_two(std::uint32_t n) {
  std::uint32_t power = 1;
  while (power < n) power *= 2;
  return power;
}

template <std::uint32_t ChunkSize>
class LazyStealing : public TraversalStrategy {
 public:
  explicit LazyStealing(const Tuning& tuning)
      : tuning_(tuning), block_size_(tuning.block_size != 0 ? tuning.block_size : 256) {
    if (block_size_ < 32 || block_size_ > static_cast<int>(kMaxTraversalBlock) ||
        block_size_ % 32 != 0)
      throw Error(ErrorCode::invalid_argument,
                  "a block of the traversal has a multiple of 32 threads up to " +
                      std::to_string(kMaxTraversalBlock));
    if (tuning.blocks < 0) throw Error(ErrorCode::invalid_argument, "tuning.blocks is negative");
    const auto threads = static_cast<std::uint32_t>(block_size_);
    // A depth-first walk from one pair holds three pairs for each level of the tree at most.
    shape_.reserve = 256;
    const std::uint32_t least = ChunkSize + shape_.reserve + 2;
    shape_.capacity = next_power_of_two(
        tuning.capacity_hint != 0 ? least : std::max({least, 8 * threads, 4 * ChunkSize}));
    const std::uint32_t usable = shape_.capacity - shape_.reserve;
    shape_.crowded = usable > 2 * threads ? std::max(usable - 2 * threads, usable / 2) : usable / 2;
    // What the block tests in one round anyway is no surplus; with delays, stealing itself is
    // tested.
    shape_.keep = tuning.delay_ns != 0 ? 1 : threads;
  }

  bool has_front() const override { return true; }

  void reset(std::uint32_t node_count, cudaStream_t stream) override {
    const int resident = resident_blocks(traverse<Blocks>, block_size_, stack_bytes());
    // A block beyond the batches of a usual front would only wait.
    const std::uint64_t batches =
        24 * std::uint64_t{node_count} / static_cast<std::uint64_t>(block_size_) + 1;
    blocks_ = static_cast<std::uint32_t>(
        tuning_.blocks != 0
            ? tuning_.blocks
            : static_cast<int>(std::min<std::uint64_t>(batches, std::max(resident, 1))));
    const bool forced = tuning_.capacity_hint != 0;
    ring_capacity_ = std::max(ring_capacity_,
                              forced ? next_power_of_two(std::min(tuning_.capacity_hint, 8u)) : 8u);
    chunk_count_ = std::max(chunk_count_, forced ? tuning_.capacity_hint : 8 * blocks_);
    make_room(stream);
  }

  void launch(const TraversalJob& job, cudaStream_t stream) override {
    const View view = this->view();
    launch_behind(start_traversal<Blocks>, 1, 1, 0, stream, view, job);
    launch_behind(traverse<Blocks>, blocks_, static_cast<std::uint32_t>(block_size_), stack_bytes(),
                  stream, view, job, shape_);
  }

  void grow(cudaStream_t stream) override {
    chunk_count_ *= 2;
    ring_capacity_ = std::min(2 * ring_capacity_, Deque<DeviceAtomics>::max_capacity);
    make_room(stream);
  }

  std::size_t bytes() const override {
    return counters_.bytes() + last_giver_.bytes() + words_.bytes() + rings_.bytes() +
           links_.bytes() + chunks_.bytes();
  }

 private:
  using Blocks = LazyBlocks<ChunkSize>;
  using View = typename Blocks::View;
  using Protocol = decltype(View::shared);
  using Word = typename Protocol::template Spaced<std::uint64_t>;

  std::size_t stack_bytes() const { return shape_.capacity * sizeof(NodePair); }

  // Zeroed memory is empty deques and all chunks free.
  void make_room(cudaStream_t stream) {
    const auto zeroed = [stream](auto& buffer, std::size_t count) {
      buffer.reserve(count);
      LAZYCCD_CUDA_CHECK(cudaMemsetAsync(buffer.data(), 0, buffer.bytes(), stream));
    };
    zeroed(counters_, 1);
    zeroed(last_giver_, 1);
    zeroed(words_, blocks_);
    zeroed(rings_, std::size_t{blocks_} * ring_capacity_);
    zeroed(links_, chunk_count_);
    chunks_.reserve(chunk_count_);
  }

  View view() {
    View view{};
    view.shared.workers = blocks_;
    view.shared.ring_capacity = ring_capacity_;
    view.shared.chunk_count = chunk_count_;
    view.shared.counters = counters_.data();
    view.shared.deque_words = words_.data();
    view.shared.rings = rings_.data();
    view.shared.links = links_.data();
    view.shared.chunks = chunks_.data();
    view.last_giver = last_giver_.data();
    return view;
  }

  Tuning tuning_;
  int block_size_;
  std::uint32_t blocks_ = 0;
  StackShape shape_{};
  std::uint32_t ring_capacity_ = 0, chunk_count_ = 0;
  DeviceBuffer<typename Protocol::Counters> counters_;
  DeviceBuffer<std::uint32_t> last_giver_;
  DeviceBuffer<Word> words_;
  DeviceBuffer<std::uint32_t> rings_, links_;
  DeviceBuffer<typename Blocks::Chunk> chunks_;
};

}  // namespace

std::unique_ptr<TraversalStrategy> make_lazy_stealing(const Tuning& tuning) {
  switch (tuning.chunk) {
    case 32:
      return std::make_unique<LazyStealing<32>>(tuning);
    case 128:
      return std::make_unique<LazyStealing<128>>(tuning);
    case 0:
    case 256:
      return std::make_unique<LazyStealing<256>>(tuning);
    default:
      throw Error(ErrorCode::invalid_argument, "chunks are of 32, 128 or 256 pairs");
  }
}

}  // namespace lazyccd::gpu
