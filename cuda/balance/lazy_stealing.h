// Lazy work stealing for continuous traversal (da Silva, section 3.4), with the protocol repaired.
// The same code runs on CPU threads and on CUDA blocks.
//
// A worker is a CPU thread or a CUDA block. It holds items of its own, which only it can see, and a
// deque of chunks (deque.h), from which every worker may steal. To offer items, it copies them to a
// free chunk and pushes the id of the chunk onto its deque. When it has no items left, it takes a
// chunk from its own deque, then a portion of the initial items, then a chunk from the deque of
// another worker. Termination (termination.h) detects when all work is done. If a deque or the pool
// of chunks is full, the worker keeps its items, so no work is lost.
//
// It is lazy in two ways. Work moves in chunks and only by id: a steal is one CAS, and the items
// stay in place until the new owner needs them. A CPU worker offers nothing as long as its deque
// already holds a chunk for every idle worker: should_offer() compares the two numbers. A CUDA
// block offers what does not fit its stack.
//
// Model: tests/model/lazy_stealing.pml.
#pragma once

#include <cstddef>
#include <cstdint>

#include "balance/chunk_pool.h"
#include "balance/deque.h"
#include "balance/portions.h"
#include "balance/termination.h"
#include "core/platform.h"

namespace lazyccd {

/// The state that the workers of a run share: a view, passed by value to a kernel. Zeroed memory is
/// a run without work, except for `live`, which starts as the number of chunks in `initial`.
template <class Atomics, class Item, std::uint32_t ChunkSize>
struct LazyStealingView {
  template <class T>
  using Cell = typename Atomics::template Cell<T>;
  /// A cell aligned to Atomics::spacing, which keeps it apart from cells that other workers write.
  template <class T>
  struct alignas(Atomics::spacing) Spaced {
    Cell<T> cell;
  };
  /// A cell that all workers poll, aligned to Atomics::line.
  template <class T>
  struct alignas(Atomics::line) Hot {
    Cell<T> cell;
  };

  struct Counters {
    Hot<std::uint64_t> free_head;     // FreeList
    Hot<std::uint32_t> live;          // Termination
    Hot<std::uint64_t> claimed;       // initial items claimed so far; may exceed their number
    Hot<std::uint32_t> idle_workers;  // number of workers that look for work
    Hot<std::uint32_t> cancelled;     // nonzero: stop
  };

  std::uint32_t workers;
  std::uint32_t ring_capacity;  // chunks per deque, a power of two
  std::uint32_t chunk_count;
  Counters* counters;
  Spaced<std::uint64_t>* deque_words;  // one per worker
  Cell<std::uint32_t>* rings;          // ring_capacity per worker
  Cell<std::uint32_t>* links;          // one per chunk
  Chunk<Item, ChunkSize>* chunks;
  const Item* initial;  // work at the start; claimed in portions of ChunkSize, read in place
  std::uint64_t initial_count;

  LAZYCCD_HD Deque<Atomics> deque(std::uint32_t worker) const {
    return {deque_words[worker].cell, rings + std::size_t{worker} * ring_capacity, ring_capacity};
  }
  LAZYCCD_HD FreeList<Atomics> free_list() const {
    return {counters->free_head.cell, links, chunk_count};
  }
  LAZYCCD_HD Termination<Atomics> termination() const {
    return Termination<Atomics>(counters->live.cell);
  }
};

/// The protocol of one worker, called by one thread of it. The caller copies the items in and out:
/// a CPU thread does so alone, a block with all its threads between two barriers. The order of
/// calls:
///
///   arrive
///   own_batch; if it is empty, steal from one victim after another
///     until one returns a batch; leave if over() or cancelled()
///   copy the batch; release_chunk
///   process the items; if should_offer(), or if there are more items than the worker wants to
///     hold: new_chunk, fill it, publish
///   when all own items are done: own_batch again
///
/// A trivial type, so it can be placed in a block's shared memory.
template <class Atomics, class Item, std::uint32_t ChunkSize, std::uint32_t CacheSize = 8>
class LazyStealingWorker {
 public:
  using View = LazyStealingView<Atomics, Item, ChunkSize>;

  /// Joins the run as worker number `worker`. The worker starts idle.
  LAZYCCD_HD void arrive(const View& view, std::uint32_t worker) {
    view_ = view;
    worker_ = worker;
    filling_ = no_chunk;
    busy_ = false;
    own_chunks_bound_ = 0;
    claims_.start(view.initial_count);
    cache_.clear();
    steals_ = 0;
    overflows_ = 0;
    // Relaxed, here and wherever idle_workers changes: it is a hint and publishes nothing.
    Atomics::fetch_add(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
  }

  /// Returns the free chunks. If the run was cancelled, the worker still counts as idle. Then busy
  /// workers try to offer work, and so they notice the cancellation.
  LAZYCCD_HD void leave() { cache_.flush(view_.free_list()); }

  /// Whether more workers are idle than this worker has chunks in its deque.
  LAZYCCD_HD bool should_offer() const {
    const std::uint32_t idle = Atomics::load(view_.counters->idle_workers.cell, Atomics::relaxed);
    return idle > (own_chunks_bound_ != 0 ? view_.deque(worker_).size() : 0);
  }

  /// Returns a free chunk to fill, or null if the own deque or the pool of chunks is exhausted.
  /// Then the caller keeps its items and goes on with them.
  LAZYCCD_HD Chunk<Item, ChunkSize>* new_chunk() {
    // Issued first: its latency overlaps with take().
    deque_word_ = view_.deque(worker_).load_word();
    filling_ = cache_.take(view_.free_list());
    if (filling_ != no_chunk && view_.deque(worker_).has_room(deque_word_))
      return view_.chunks + filling_;
    if (filling_ != no_chunk) cache_.give(view_.free_list(), filling_);
    ++overflows_;
    return nullptr;
  }
  /// Offers the chunk of the last new_chunk() to all workers.
  LAZYCCD_HD void publish() {
    view_.termination().chunk_published();
    view_.deque(worker_).push(filling_, deque_word_);
    ++own_chunks_bound_;
  }

  /// Takes the newest chunk of the own deque, otherwise a portion of the initial items. If both are
  /// empty, the worker becomes idle. It has nothing left then and must not call this again before
  /// it has stolen something.
  LAZYCCD_HD Batch<Item> own_batch() {
    const std::uint32_t chunk = own_chunks_bound_ != 0 ? view_.deque(worker_).pop() : no_chunk;
    own_chunks_bound_ = chunk != no_chunk ? own_chunks_bound_ - 1 : 0;
    const Batch<Item> batch = chunk != no_chunk ? batch_of(chunk) : claim_initial();
    if (batch.count == 0) {
      become_idle();
    } else if (busy_) {
      view_.termination().unit_ended();
    } else {
      become_busy();
    }
    return batch;
  }

  /// Tries once to steal the oldest chunk of another worker's deque. Requires that this worker is
  /// idle.
  LAZYCCD_HD Batch<Item> steal(std::uint32_t victim) {
    const std::uint32_t chunk = view_.deque(victim).steal();
    if (chunk == no_chunk) return empty_batch();
    ++steals_;
    become_busy();
    return batch_of(chunk);
  }

  /// Frees the chunk of a batch that has been copied.
  LAZYCCD_HD void release_chunk(const Batch<Item>& batch) {
    if (batch.chunk != no_chunk) cache_.give(view_.free_list(), batch.chunk);
  }

  LAZYCCD_HD bool over() const { return view_.termination().over(); }

  /// Whether a worker gave up (an exception, or an output that is full). Then all leave, and work
  /// is left undone.
  LAZYCCD_HD bool cancelled() const {
    // Relaxed: only a request to stop. The cause is passed on at the end of the job.
    return Atomics::load(view_.counters->cancelled.cell, Atomics::relaxed) != 0;
  }
  LAZYCCD_HD void cancel() {
    Atomics::store(view_.counters->cancelled.cell, 1u, Atomics::relaxed);  // see cancelled()
    become_idle();
  }

  LAZYCCD_HD std::uint64_t steals() const { return steals_; }
  LAZYCCD_HD std::uint64_t overflows() const { return overflows_; }

 private:
  LAZYCCD_HD static Batch<Item> empty_batch() { return {nullptr, 0, no_chunk}; }

  LAZYCCD_HD Batch<Item> batch_of(std::uint32_t chunk) const {
    return {view_.chunks[chunk].items, view_.chunks[chunk].count, chunk};
  }

  LAZYCCD_HD Batch<Item> claim_initial() {
    const Portion portion = claims_.template next<Atomics>(view_.counters->claimed.cell, ChunkSize);
    return {view_.initial + portion.first, portion.count, no_chunk};
  }

  LAZYCCD_HD void become_busy() {
    busy_ = true;
    Atomics::fetch_sub(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
  }
  LAZYCCD_HD void become_idle() {
    if (!busy_) return;
    busy_ = false;
    Atomics::fetch_add(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
    view_.termination().unit_ended();
  }

  View view_;
  std::uint32_t worker_;
  std::uint32_t filling_;
  std::uint64_t deque_word_;        // word of the own deque, loaded by new_chunk()
  std::uint32_t own_chunks_bound_;  // upper bound: others can only take chunks from the own deque
  bool busy_;                       // counted in `live` (Termination)
  Claims claims_;
  ChunkCache<CacheSize> cache_;
  std::uint64_t steals_;
  std::uint64_t overflows_;
};

}  // namespace lazyccd
