// Lazy work stealing as published (da Silva, section 3.4, Algorithms 3.7 to 3.13), with its errors
// corrected. A worker moves batches from its full stack to its own deque, whether or not another
// worker is idle. An idle worker takes one batch from every deque at once (greedy). The batches
// that it won stay in place; it moves one only when it has run out of items again (lazy).
//
// Differences from the published text:
//   - top and bottom change by one CAS over both (deque.h), so no item is taken twice;
//   - a batch stays in its owner's memory until its taker has copied it and clears `in_use`; then
//     the memory is used again;
//   - a batch that was won and not yet moved counts as live, so no worker leaves while one is left;
//   - a worker offers its oldest items, which head the largest subtrees, instead of its newest.
// Model: tests/model/greedy_stealing.pml.
#pragma once

#include <cstddef>
#include <cstdint>

#include "balance/chunk_pool.h"
#include "balance/deque.h"
#include "balance/portions.h"
#include "balance/termination.h"
#include "core/platform.h"

namespace lazyccd::research {

/// The state that the workers of a run share: a view. Zeroed memory is a run without work, except
/// for `live`, which starts as the number of portions of BatchSize in `initial`.
template <class Atomics, class Item, std::uint32_t BatchSize>
struct GreedyStealingView {
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
    Hot<std::uint32_t> live;       // Termination
    Hot<std::uint64_t> claimed;    // initial items claimed so far; may exceed their number
    Hot<std::uint32_t> cancelled;  // nonzero: stop
  };

  std::uint32_t workers;
  std::uint32_t batches;  // per worker, a power of two; also the slots of its deque
  Counters* counters;
  Spaced<std::uint64_t>* deque_words;  // one per worker
  Cell<std::uint32_t>* rings;          // `batches` per worker
  Cell<std::uint32_t>* in_use;         // one per batch
  Chunk<Item, BatchSize>* chunks;      // `batches` per worker
  std::uint32_t* won;                  // `workers` per worker: batches taken and not yet moved
  const Item* initial;
  std::uint64_t initial_count;

  LAZYCCD_HD Deque<Atomics> deque(std::uint32_t worker) const {
    return {deque_words[worker].cell, rings + std::size_t{worker} * batches, batches};
  }
  LAZYCCD_HD Termination<Atomics> termination() const {
    return Termination<Atomics>(counters->live.cell);
  }
};

/// The protocol of one worker, called by one thread of it. The order of calls:
///
///   arrive
///   own_batch; if it is empty, steal_from_all until it returns true, or over() or cancelled()
///   copy the batch; release
///   process the items; if the stack is full: new_batch, fill it, publish
///   when all own items are done: own_batch again
template <class Atomics, class Item, std::uint32_t BatchSize>
class GreedyStealingWorker {
 public:
  using View = GreedyStealingView<Atomics, Item, BatchSize>;

  /// Joins the run as worker number `worker`. The worker starts idle.
  LAZYCCD_HD void arrive(const View& view, std::uint32_t worker) {
    view_ = view;
    worker_ = worker;
    next_ = 0;
    claims_.start(view.initial_count);
    won_count_ = 0;
    busy_ = false;
    steals_ = overflows_ = 0;
  }

  /// Returns a free batch of this worker to fill, or null if all are in use. Then the worker keeps
  /// its items.
  LAZYCCD_HD Chunk<Item, BatchSize>* new_batch() {
    deque_word_ = view_.deque(worker_).load_word();
    if (view_.deque(worker_).has_room(deque_word_)) {
      for (std::uint32_t i = 0; i < view_.batches; ++i) {
        filling_ = worker_ * view_.batches + (next_ + i) % view_.batches;
        // Acquire: pairs with the release in release(). The taker has read the batch.
        if (Atomics::load(view_.in_use[filling_], Atomics::acquire) != 0) continue;
        next_ = (next_ + i + 1) % view_.batches;
        Atomics::store(view_.in_use[filling_], 1u, Atomics::relaxed);  // published by the push
        return view_.chunks + filling_;
      }
    }
    ++overflows_;
    return nullptr;
  }
  /// Offers the batch of the last new_batch() to all workers.
  LAZYCCD_HD void publish() {
    view_.termination().chunk_published();
    view_.deque(worker_).push(filling_, deque_word_);
  }

  /// Takes the newest batch of the own deque, otherwise one that was won, otherwise a portion of
  /// the initial items. If all are empty, the worker becomes idle.
  LAZYCCD_HD Batch<Item> own_batch() {
    std::uint32_t batch = view_.deque(worker_).pop();
    if (batch == no_chunk && won_count_ != 0) batch = won_batches()[--won_count_];
    Batch<Item> taken = {nullptr, 0, no_chunk};
    if (batch != no_chunk) {
      taken = {view_.chunks[batch].items, view_.chunks[batch].count, batch};
    } else {
      const Portion portion =
          claims_.template next<Atomics>(view_.counters->claimed.cell, BatchSize);
      taken = {view_.initial + portion.first, portion.count, no_chunk};
    }
    // An idle worker takes over the unit of the batch. A busy worker ends one unit: that of the
    // batch, or its own if there was no batch.
    if (taken.count != 0 && !busy_) {
      busy_ = true;
    } else if (busy_) {
      view_.termination().unit_ended();
      busy_ = taken.count != 0;
    }
    return taken;
  }
  /// Frees a batch that has been copied.
  LAZYCCD_HD void release(const Batch<Item>& taken) {
    // Release: pairs with the acquire in new_batch().
    if (taken.chunk != no_chunk) Atomics::store(view_.in_use[taken.chunk], 0u, Atomics::release);
  }

  /// Takes the oldest batch of each other deque; false if it got none. Requires that the worker is
  /// idle and has no won batches left.
  LAZYCCD_HD bool steal_from_all() {
    std::uint32_t count = 0;
    for (std::uint32_t i = 1; i < view_.workers; ++i) {
      const std::uint32_t batch = view_.deque((worker_ + i) % view_.workers).steal();
      if (batch != no_chunk) hold(count++, batch);
    }
    won(count);
    return count != 0;
  }
  /// The same in two parts, for workers of several threads. Each thread steals from deques of its
  /// own and stores what it got at the next free place. Then one thread calls won() with their
  /// number. A batch keeps its unit of `live` until own_batch() moves it.
  LAZYCCD_HD void hold(std::uint32_t place, std::uint32_t batch) const {
    won_batches()[place] = batch;
  }
  LAZYCCD_HD void won(std::uint32_t count) {
    won_count_ = count;
    steals_ += count;
  }

  LAZYCCD_HD bool over() const { return view_.termination().over(); }
  // Relaxed, here and in cancel(): only a request to stop. The cause is passed on at the end of the
  // job.
  LAZYCCD_HD bool cancelled() const {
    return Atomics::load(view_.counters->cancelled.cell, Atomics::relaxed) != 0;
  }
  LAZYCCD_HD void cancel() { Atomics::store(view_.counters->cancelled.cell, 1u, Atomics::relaxed); }

  LAZYCCD_HD std::uint64_t steals() const { return steals_; }
  LAZYCCD_HD std::uint64_t overflows() const { return overflows_; }

 private:
  LAZYCCD_HD std::uint32_t* won_batches() const {
    return view_.won + std::size_t{worker_} * view_.workers;
  }

  View view_;
  std::uint32_t worker_;
  std::uint32_t filling_;
  std::uint64_t deque_word_;  // word of the own deque, loaded by new_batch()
  std::uint32_t next_;        // own batch at which the search for a free one starts
  std::uint32_t won_count_;
  bool busy_;  // counted in `live` (Termination)
  Claims claims_;
  std::uint64_t steals_;
  std::uint64_t overflows_;
};

}  // namespace lazyccd::research
