// Lazy work stealing between CPU threads: owns the memory that balance/lazy_stealing.h works on,
// and decides how a thread waits. One of the strategies of BalancedRun, which says what a strategy
// is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "balance/host_atomics.h"
#include "balance/lazy_stealing.h"
#include "cpu/strategies/work_stack.h"
#include "cpu/strategies/worker_counts.h"
#include "host/threads/spin_wait.h"

namespace lazyccd {

template <class ItemType, std::uint32_t ChunkSize = 256>
class LazyStealing {
 public:
  using Item = ItemType;
  static constexpr bool everyone = false;

  /// ring_capacity: chunks per deque, a power of two. chunks: their total number. 0 for either:
  /// enough for all that BalancedRun does. Less is correct too: items that find no room stay with
  /// their worker. chunk_size: items that a worker offers at once, at most ChunkSize; 0: ChunkSize.
  explicit LazyStealing(int workers, std::uint32_t ring_capacity = 0, std::uint32_t chunks = 0,
                        std::uint32_t chunk_size = 0)
      : chunk_size_(chunk_size != 0 ? std::min(chunk_size, ChunkSize) : ChunkSize),
        members_(static_cast<std::size_t>(workers)) {
    const auto count = static_cast<std::uint32_t>(workers);
    // A worker offers at most as many chunks as there are idle workers.
    if (ring_capacity == 0) ring_capacity = next_power_of_two(count);
    if (chunks == 0) chunks = count * (ring_capacity + cache_size);
    deque_words_.reset(new typename View::template Spaced<std::uint64_t>[count]);
    rings_.reset(new Slot[std::size_t{count} * ring_capacity]);
    links_.reset(new Slot[chunks]);
    chunks_.reset(new Chunk<Item, ChunkSize>[chunks]);
    view_ = {count,        ring_capacity, chunks,        &counters_, deque_words_.get(),
             rings_.get(), links_.get(),  chunks_.get(), nullptr,    0};
    reset();
  }

  /// Called by one thread, before the workers. `initial` must stay valid and unchanged during the
  /// run.
  void start(const Item* initial, std::size_t count) {
    // Relaxed throughout: the start of the job publishes it.
    if (HostAtomics::load(counters_.cancelled.cell, HostAtomics::relaxed) != 0) reset();
    view_.initial = initial;
    view_.initial_count = count;
    const auto chunks = static_cast<std::uint32_t>((count + ChunkSize - 1) / ChunkSize);
    HostAtomics::store(counters_.live.cell, chunks, HostAtomics::relaxed);
    HostAtomics::store(counters_.claimed.cell, std::uint64_t{0}, HostAtomics::relaxed);
    HostAtomics::store(counters_.idle_workers.cell, 0u, HostAtomics::relaxed);
    for (Member& member : members_) member.counts = {};
  }

  void arrive(int worker) {
    Member& m = member(worker);
    m.protocol.arrive(view_, static_cast<std::uint32_t>(worker));
    m.victim = static_cast<std::uint32_t>(worker);
  }

  /// Fills the empty stack, waiting if needed. False: the run is over or cancelled.
  bool take(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    Batch<Item> batch = m.protocol.own_batch();
    SpinWait waiting(m.counts.ms_waited);
    while (batch.count == 0) {
      if (m.protocol.over() || m.protocol.cancelled()) return false;
      // The own deque is among the victims. It is empty now, so that is harmless. The last victim
      // that had work comes first.
      batch = m.protocol.steal(m.victim);
      if (batch.count != 0) break;
      m.victim = m.victim + 1 < view_.workers ? m.victim + 1 : 0;
      waiting.pause();
    }
    stack.push(batch.items, batch.count);
    m.protocol.release_chunk(batch);
    return true;
  }

  bool should_share(int worker, const WorkStack<Item>&) const {
    return member(worker).protocol.should_offer();
  }

  /// Offers half of the items, every second one from the oldest on, up to chunk_size. False: the
  /// run is cancelled.
  bool share(int worker, WorkStack<Item>& stack) {
    Member& m = member(worker);
    if (m.protocol.cancelled()) return false;
    const std::size_t count = std::min<std::size_t>(stack.size() / 2, chunk_size_);
    if (count == 0) return true;
    if (Chunk<Item, ChunkSize>* chunk = m.protocol.new_chunk()) {
      stack.take_every_second(chunk->items, count);
      chunk->count = static_cast<std::uint32_t>(count);
      m.protocol.publish();
    }
    return true;
  }

  void cancel(int worker) { member(worker).protocol.cancel(); }

  void leave(int worker) {
    Member& m = member(worker);
    m.protocol.leave();
    m.counts.steals = m.protocol.steals();
    m.counts.overflows = m.protocol.overflows();
  }

  WorkerCounts counts(int worker) const { return member(worker).counts; }
  std::size_t bytes() const {
    return sizeof(*this) + view_.workers * (sizeof(Member) + sizeof(deque_words_[0])) +
           (std::size_t{view_.workers} * view_.ring_capacity + view_.chunk_count) * sizeof(Slot) +
           view_.chunk_count * sizeof(Chunk<Item, ChunkSize>);
  }

 private:
  static constexpr std::uint32_t cache_size = 8;
  using View = LazyStealingView<HostAtomics, Item, ChunkSize>;
  using Slot = typename HostAtomics::Cell<std::uint32_t>;
  struct alignas(HostAtomics::spacing) Member {
    LazyStealingWorker<HostAtomics, Item, ChunkSize, cache_size> protocol;
    std::uint32_t victim = 0;
    WorkerCounts counts;  // zero for a worker that did not take part
  };

  static std::uint32_t next_power_of_two(std::uint32_t n) {
    std::uint32_t power = 1;
    while (power < n) power *= 2;
    return power;
  }

  Member& member(int worker) { return members_[static_cast<std::size_t>(worker)]; }
  const Member& member(int worker) const { return members_[static_cast<std::size_t>(worker)]; }

  /// Empties the deques and frees all chunks. Drops what a cancelled run left behind.
  void reset() {
    const auto zero = [](auto& cell) { HostAtomics::store(cell, {}, HostAtomics::relaxed); };
    zero(counters_.free_head.cell);
    zero(counters_.cancelled.cell);
    for (std::uint32_t i = 0; i < view_.workers; ++i) zero(deque_words_[i].cell);
    for (std::uint32_t i = 0; i < view_.workers * view_.ring_capacity; ++i) zero(rings_[i]);
    for (std::uint32_t i = 0; i < view_.chunk_count; ++i) zero(links_[i]);
  }

  std::uint32_t chunk_size_;
  typename View::Counters counters_;
  std::unique_ptr<typename View::template Spaced<std::uint64_t>[]> deque_words_;
  std::unique_ptr<Slot[]> rings_;
  std::unique_ptr<Slot[]> links_;
  std::unique_ptr<Chunk<Item, ChunkSize>[]> chunks_;
  View view_;
  std::vector<Member> members_;
};

}  // namespace lazyccd
