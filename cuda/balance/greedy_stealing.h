// Lazy work stealing as the dissertation has it (section 3.4, Algorithms 3.7 to 3.13), with its
// holes closed. Its idea: batches go from a worker's full stack to its own deque, whether somebody
// waits or not; an idle worker takes one batch from every deque at once (greedy); what it won stays
// where it lies, and moves only when it has run out again (lazy).
//
// What differs from the published text:
//   - top and bottom change by one CAS over both (deque.h), so no item is taken twice;
//   - a batch stays in its owner's memory until its taker has copied it and says so (`in_use`), and
//     that memory is used again;
//   - a batch that was won and not yet moved counts as live, so nobody leaves while one is left;
//   - the oldest items are offered, which head the largest subtrees, not the newest.
// Model: tests/model/greedy_stealing.pml.
#pragma once

#include <cstddef>
#include <cstdint>

#include "balance/chunk_pool.h"
#include "balance/deque.h"
#include "balance/portions.h"
#include "balance/termination.h"
#include "core/platform.h"

namespace lazyccd {

// What the workers of a run share: a view. Zeroed memory is a run without work, apart from `live`,
// which starts as the number of portions of BatchSize in `initial`.
template <class Atomics, class Item, std::uint32_t BatchSize>
struct GreedyStealingView {
  template <class T>
  using Cell = typename Atomics::template Cell<T>;
  template <class T>
  struct alignas(Atomics::spacing) Spaced {  // no other writer's cell near it
    Cell<T> cell;
  };
  template <class T>
  struct alignas(Atomics::line) Hot {  // a cell that all workers poll
    Cell<T> cell;
  };

  struct Counters {
    Hot<std::uint32_t> live;       // Termination
    Hot<std::uint64_t> claimed;    // initial items that workers have taken, or more
    Hot<std::uint32_t> cancelled;  // nonzero: stop
  };

  std::uint32_t workers;
  std::uint32_t batches;  // of each worker, a power of two: slots of its deque too
  Counters* counters;
  Spaced<std::uint64_t>* deque_words;  // one a worker
  Cell<std::uint32_t>* rings;          // `batches` a worker
  Cell<std::uint32_t>* in_use;         // one a batch
  Chunk<Item, BatchSize>* chunks;      // `batches` a worker
  std::uint32_t* won;                  // `workers` a worker: batches taken and not yet moved
  const Item* initial;
  std::uint64_t initial_count;

  LAZYCCD_HD Deque<Atomics> deque(std::uint32_t worker) const {
    return {deque_words[worker].cell, rings + std::size_t{worker} * batches, batches};
  }
  LAZYCCD_HD Termination<Atomics> termination() const {
    return Termination<Atomics>(counters->live.cell);
  }
};

// One worker's side, for one thread of it. The order of calls:
//
//   arrive
//   own_batch; where it is empty, steal_from_all until it returns true, or over() or cancelled()
//   copy the batch; release
//   work; where the stack is full: new_batch, fill it, publish
//   with all own items done, own_batch again
template <class Atomics, class Item, std::uint32_t BatchSize>
class GreedyStealingWorker {
 public:
  using View = GreedyStealingView<Atomics, Item, BatchSize>;

  LAZYCCD_HD void arrive(const View& view, std::uint32_t worker) {
    view_ = view;
    worker_ = worker;
    next_ = 0;
    claims_.start(view.initial_count);
    won_count_ = 0;
    busy_ = false;
    steals_ = overflows_ = 0;
  }

  // A free batch of this worker's own, or null where all are under way: it keeps its items.
  LAZYCCD_HD Chunk<Item, BatchSize>* new_batch() {
    seen_ = view_.deque(worker_).look();
    if (view_.deque(worker_).has_room(seen_)) {
      for (std::uint32_t i = 0; i < view_.batches; ++i) {
        filling_ = worker_ * view_.batches + (next_ + i) % view_.batches;
        // Acquire, pairs with the release in release(): the taker has read it.
        if (Atomics::load(view_.in_use[filling_], Atomics::acquire) != 0) continue;
        next_ = (next_ + i + 1) % view_.batches;
        Atomics::store(view_.in_use[filling_], 1u, Atomics::relaxed);  // published by the push
        return view_.chunks + filling_;
      }
    }
    ++overflows_;
    return nullptr;
  }
  LAZYCCD_HD void publish() {
    view_.termination().chunk_published();
    view_.deque(worker_).push(filling_, seen_);
  }

  // From the own deque, then from what was won, then from the initial items. Where all are empty
  // the worker turns idle.
  LAZYCCD_HD Batch<Item> own_batch() {
    std::uint32_t batch = view_.deque(worker_).pop();
    if (batch == no_chunk && won_count_ != 0) batch = held()[--won_count_];
    Batch<Item> taken = {nullptr, 0, no_chunk};
    if (batch != no_chunk) {
      taken = {view_.chunks[batch].items, view_.chunks[batch].count, batch};
    } else {
      const Portion portion =
          claims_.template next<Atomics>(view_.counters->claimed.cell, BatchSize);
      taken = {view_.initial + portion.first, portion.count, no_chunk};
    }
    // The unit of what was taken becomes the worker's own, or is one too many, or the last to go.
    if (taken.count != 0 && !busy_) {
      busy_ = true;
    } else if (busy_) {
      view_.termination().unit_ended();
      busy_ = taken.count != 0;
    }
    return taken;
  }
  LAZYCCD_HD void release(const Batch<Item>& taken) {
    // Release, pairs with the acquire in new_batch().
    if (taken.chunk != no_chunk) Atomics::store(view_.in_use[taken.chunk], 0u, Atomics::release);
  }

  // The oldest batch of each deque; false: nothing was there. The worker is idle and has won
  // nothing that is left.
  LAZYCCD_HD bool steal_from_all() {
    std::uint32_t count = 0;
    for (std::uint32_t i = 1; i < view_.workers; ++i) {
      const std::uint32_t batch = view_.deque((worker_ + i) % view_.workers).steal();
      if (batch != no_chunk) hold(count++, batch);
    }
    won(count);
    return count != 0;
  }
  // The same in parts, for workers of several threads: each steals from deques of its own and holds
  // what it got at the next free place, then one says how many they are. A batch keeps the unit
  // that it counts for until own_batch() moves it.
  LAZYCCD_HD void hold(std::uint32_t place, std::uint32_t batch) const { held()[place] = batch; }
  LAZYCCD_HD void won(std::uint32_t count) {
    won_count_ = count;
    steals_ += count;
  }

  LAZYCCD_HD bool over() const { return view_.termination().over(); }
  // Relaxed, here and in cancel(): a wish to stop; what happened travels with the end of the job.
  LAZYCCD_HD bool cancelled() const {
    return Atomics::load(view_.counters->cancelled.cell, Atomics::relaxed) != 0;
  }
  LAZYCCD_HD void cancel() { Atomics::store(view_.counters->cancelled.cell, 1u, Atomics::relaxed); }

  LAZYCCD_HD std::uint64_t steals() const { return steals_; }
  LAZYCCD_HD std::uint64_t overflows() const { return overflows_; }

 private:
  LAZYCCD_HD std::uint32_t* held() const {
    return view_.won + std::size_t{worker_} * view_.workers;
  }

  View view_;
  std::uint32_t worker_;
  std::uint32_t filling_;
  std::uint64_t seen_;  // of the own deque
  std::uint32_t next_;  // of the own batches, where to look for a free one
  std::uint32_t won_count_;
  bool busy_;  // holds a unit of `live`
  Claims claims_;
  std::uint64_t steals_;
  std::uint64_t overflows_;
};

}  // namespace lazyccd
