// Lazy work stealing for continuous traversal (da Silva, section 3.4, with the protocol repaired;
// see deque.h and termination.h), the same for CPU threads and CUDA blocks.
//
// Work travels in chunks and only by id: a steal is one CAS, the items stay where they were written
// until their new owner needs them. A worker can be lazy on the giving side too: it looks at one
// counter (`hungry`) and publishes nothing while nobody waits.
#pragma once

#include <cstddef>
#include <cstdint>

#include "balance/chunk_pool.h"
#include "balance/deque.h"
#include "balance/portions.h"
#include "balance/termination.h"
#include "core/platform.h"

namespace lazyccd {

// What the workers of a run share: a view, passed by value to a kernel. Zeroed memory is a run
// without work, apart from `live`, which starts as the number of chunks in `initial`.
template <class Atomics, class Item, std::uint32_t ChunkSize>
struct LazyStealingView {
  template <class T>
  using Cell = typename Atomics::template Cell<T>;
  // A cell with no other cell of another writer near it.
  template <class T>
  struct alignas(Atomics::spacing) Spaced {
    Cell<T> cell;
  };
  template <class T>
  struct alignas(Atomics::line) Hot {  // a cell that all workers poll
    Cell<T> cell;
  };

  struct Counters {
    Hot<std::uint64_t> free_head;  // FreeList
    Hot<std::uint32_t> live;       // Termination
    Hot<std::uint64_t> claimed;    // initial items that workers have taken, or more
    Hot<std::uint32_t> idle_workers;     // workers that look for work
    Hot<std::uint32_t> cancelled;  // nonzero: stop
  };

  std::uint32_t workers;
  std::uint32_t ring_capacity;  // chunks a deque, a power of two
  std::uint32_t chunk_count;
  Counters* counters;
  Spaced<std::uint64_t>* deque_words;  // one a worker
  Cell<std::uint32_t>* rings;          // ring_capacity a worker
  Cell<std::uint32_t>* links;          // one a chunk
  Chunk<Item, ChunkSize>* chunks;
  const Item* initial;  // work at the start, cut into chunks of ChunkSize where it lies
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

// One worker's side, for one thread of it. Copying items in and out is left to the caller: a CPU
// thread does it alone, a block with all its threads between two barriers. The order of calls:
//
//   arrive
//   own_batch; where it is empty, steal from one victim after another
//     until one gives a batch, or over() or cancelled(): leave
//   copy the batch; release_chunk
//   work; where hungry(), or where there is more than one wants to hold: new_chunk, fill it,
//   publish with all own items done, own_batch again
//
// Trivial, so that it can lie in a block's shared memory.
template <class Atomics, class Item, std::uint32_t ChunkSize, std::uint32_t CacheSize = 8>
class LazyStealingWorker {
 public:
  using View = LazyStealingView<Atomics, Item, ChunkSize>;

  LAZYCCD_HD void arrive(const View& view, std::uint32_t worker) {
    view_ = view;
    worker_ = worker;
    filling_ = no_chunk;
    busy_ = false;
    current_ = 0;
    claims_.start(view.initial_count);
    cache_.clear();
    steals_ = 0;
    overflows_ = 0;
    // Relaxed, here and wherever hungry changes: it is a hint and publishes nothing.
    Atomics::fetch_add(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
  }

  // Gives the private free chunks back. The worker stays counted as hungry: the run is over, or it
  // is cancelled and the others should look up.
  LAZYCCD_HD void leave() { cache_.flush(view_.free_list()); }

  // More workers wait than this one has chunks on offer.
  LAZYCCD_HD bool any_worker_idle() const {
    const std::uint32_t waiting = Atomics::load(view_.counters->idle_workers.cell, Atomics::relaxed);
    return waiting > (current_ != 0 ? view_.deque(worker_).size() : 0);
  }

  // A free chunk of this worker's, or null where ring or pool is exhausted: the caller keeps its
  // items and goes on with them.
  LAZYCCD_HD Chunk<Item, ChunkSize>* new_chunk() {
    seen_ = view_.deque(worker_).look();  // both are under way at once
    filling_ = cache_.take(view_.free_list());
    if (filling_ != no_chunk && view_.deque(worker_).has_room(seen_))
      return view_.chunks + filling_;
    if (filling_ != no_chunk) cache_.give(view_.free_list(), filling_);
    ++overflows_;
    return nullptr;
  }
  // Offers the chunk of the last new_chunk() to everyone.
  LAZYCCD_HD void publish() {
    view_.termination().chunk_published();
    view_.deque(worker_).push(filling_, seen_);
    ++current_;
  }

  // From the own deque, newest first, then from the initial items. Where both are empty the worker
  // turns idle: it has nothing left and does not ask here again before it has stolen.
  LAZYCCD_HD Batch<Item> own_batch() {
    const std::uint32_t chunk = current_ != 0 ? view_.deque(worker_).pop() : no_chunk;
    current_ = chunk != no_chunk ? current_ - 1 : 0;
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

  // One look at the oldest chunk of another's deque. The worker is idle.
  LAZYCCD_HD Batch<Item> steal(std::uint32_t victim) {
    const std::uint32_t chunk = view_.deque(victim).steal();
    if (chunk == no_chunk) return nothing();
    ++steals_;
    become_busy();
    return batch_of(chunk);
  }

  LAZYCCD_HD void release_chunk(const Batch<Item>& batch) {
    if (batch.chunk != no_chunk) cache_.give(view_.free_list(), batch.chunk);
  }

  LAZYCCD_HD bool over() const { return view_.termination().over(); }

  // Somebody gave up (an exception, an output that is full): leave, work is left behind.
  LAZYCCD_HD bool cancelled() const {
    // Relaxed: a wish to stop; what happened travels with the end of the job.
    return Atomics::load(view_.counters->cancelled.cell, Atomics::relaxed) != 0;
  }
  LAZYCCD_HD void cancel() {
    Atomics::store(view_.counters->cancelled.cell, 1u, Atomics::relaxed);  // see cancelled()
    become_idle();
  }

  LAZYCCD_HD std::uint64_t steals() const { return steals_; }
  LAZYCCD_HD std::uint64_t overflows() const { return overflows_; }

 private:
  LAZYCCD_HD static Batch<Item> nothing() { return {nullptr, 0, no_chunk}; }

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
  std::uint64_t seen_;     // of the own deque
  std::uint32_t current_;  // chunks that the own deque holds at most: only others take meanwhile
  bool busy_;              // holds a unit of `live`
  Claims claims_;
  ChunkCache<CacheSize> cache_;
  std::uint64_t steals_;
  std::uint64_t overflows_;
};

}  // namespace lazyccd
