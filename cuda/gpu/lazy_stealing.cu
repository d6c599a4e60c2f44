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

// A grid and its blocks' stacks.
struct Grid {
  int threads = 0;  // of a block
  std::uint32_t blocks = 0;
  StackShape shape{};

  std::size_t stack_bytes() const { return shape.capacity * sizeof(NodePair); }
};

StackShape stack_shape(const Tuning& tuning, std::uint32_t threads, std::uint32_t chunk_size) {
  StackShape shape{};
  // A depth-first walk from one pair holds three pairs for each level of the tree at most.
  shape.reserve = 256;
  const std::uint32_t least = chunk_size + shape.reserve + 2;
  shape.capacity = next_power_of_two(
      tuning.capacity_hint != 0 ? least : std::max({least, 8 * threads, 4 * chunk_size}));
  const std::uint32_t usable = shape.capacity - shape.reserve;
  shape.crowded = usable > 2 * threads ? std::max(usable - 2 * threads, usable / 2) : usable / 2;
  // What the block tests in one round anyway is no surplus; with delays, stealing itself is tested.
  shape.keep = tuning.delay_ns != 0 ? 1 : threads;
  return shape;
}

template <std::uint32_t ChunkSize>
class LazyStealing : public TraversalStrategy {
 public:
  explicit LazyStealing(const Tuning& tuning) : tuning_(tuning) {
    const int threads = tuning.block_size;
    if (threads != 0 &&
        (threads < 32 || threads > static_cast<int>(kMaxTraversalBlock) || threads % 32 != 0))
      throw Error(ErrorCode::invalid_argument,
                  "a block of the traversal has a multiple of 32 threads up to " +
                      std::to_string(kMaxTraversalBlock));
    if (tuning.blocks < 0) throw Error(ErrorCode::invalid_argument, "tuning.blocks is negative");
    // From the root each round is a level deeper, and a larger block has more of a level at once;
    // from a front there is work for all from the first round on.
    from_root_.threads = threads != 0 ? threads : 512;
    from_front_.threads = threads != 0 ? threads : 256;
    for (Grid* grid : {&from_root_, &from_front_})
      grid->shape = stack_shape(tuning, static_cast<std::uint32_t>(grid->threads), ChunkSize);
  }

  bool has_front() const override { return true; }

  void reset(std::uint32_t node_count, cudaStream_t stream) override {
    for (Grid* grid : {&from_root_, &from_front_}) {
      const int resident = resident_blocks(traverse<Blocks>, grid->threads, grid->stack_bytes());
      // A block beyond the batches of a usual front would only wait.
      const std::uint64_t batches =
          24 * std::uint64_t{node_count} / static_cast<std::uint64_t>(grid->threads) + 1;
      grid->blocks = static_cast<std::uint32_t>(
          tuning_.blocks != 0
              ? tuning_.blocks
              : static_cast<int>(std::min<std::uint64_t>(batches, std::max(resident, 1))));
    }
    blocks_ = std::max(from_root_.blocks, from_front_.blocks);
    const bool forced = tuning_.capacity_hint != 0;
    ring_capacity_ = std::max(ring_capacity_,
                              forced ? next_power_of_two(std::min(tuning_.capacity_hint, 8u)) : 8u);
    chunk_count_ = std::max(chunk_count_, forced ? tuning_.capacity_hint : 8 * blocks_);
    make_room(stream);
  }

  void launch(const TraversalJob& job, cudaStream_t stream) override {
    const Grid& grid = job.initial_count != nullptr ? from_front_ : from_root_;
    const View view = this->view(grid.blocks);
    launch_behind(start_traversal<Blocks>, 1, 1, 0, stream, view, job);
    launch_behind(traverse<Blocks>, grid.blocks, static_cast<std::uint32_t>(grid.threads),
                  grid.stack_bytes(), stream, view, job, grid.shape);
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

  View view(std::uint32_t workers) {
    View view{};
    view.shared.workers = workers;
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
  Grid from_root_, from_front_;
  std::uint32_t blocks_ = 0;  // of the larger grid
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
