// One list for all, taken in shrinking portions (portions.h), without deque or theft. Once it is
// empty and somebody waits, a worker that has items gives some of them as the next list. The same
// for CPU threads and CUDA blocks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "balance/chunk_pool.h"
#include "balance/portions.h"
#include "balance/termination.h"
#include "core/platform.h"

namespace lazyccd {

// What the workers of a run share: a view. Zeroed memory is a run without work, apart from `live`,
// which starts as 1: that of the initial list.
template <class Atomics, class Item>
struct GuidedView {
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
    Hot<std::uint64_t> given;      // the list in circulation: GivenList
    Hot<std::uint32_t> giving;     // nonzero: somebody is making the next list
    Hot<std::uint32_t> idle_workers;     // workers that look for work
    Hot<std::uint32_t> cancelled;  // nonzero: stop
  };

  // Items of a list that is given.
  static constexpr std::uint32_t longest_list = 0xffff;

  std::uint32_t workers;
  std::uint32_t list_size;    // room for a list of each worker, up to longest_list
  std::uint32_t least, most;  // items that a worker takes at once, 1 at least
  Counters* counters;
  Spaced<std::uint32_t>* unread;  // one a worker: items of its list that nobody has copied yet
  Item* lists;                    // list_size a worker
  const Item* initial;
  std::uint64_t initial_count;

  LAZYCCD_HD Termination<Atomics> termination() const {
    return Termination<Atomics>(counters->live.cell);
  }
  LAZYCCD_HD Item* list(std::uint32_t worker) const {
    return lists + std::size_t{worker} * list_size;
  }
  LAZYCCD_HD std::uint32_t portion(std::uint64_t rest) const {
    const std::uint32_t size = guided_size(rest, workers);
    const std::uint32_t large = size > least ? size : least;
    const std::uint32_t bounded = large < most ? large : most;
    return bounded < rest ? bounded : static_cast<std::uint32_t>(rest);
  }
};

// Whose list it is and which part of it is still there. Whoever exchanges the word owns the
// portion, however often the same word has come and gone.
struct GivenList {
  std::uint32_t worker, next, end;

  LAZYCCD_HD static GivenList unpack(std::uint64_t bits) {
    return {static_cast<std::uint32_t>(bits >> 32), static_cast<std::uint32_t>(bits >> 16 & 0xffff),
            static_cast<std::uint32_t>(bits & 0xffff)};
  }
  LAZYCCD_HD std::uint64_t pack() const {
    return std::uint64_t{worker} << 32 | std::uint64_t{next} << 16 | end;
  }
  LAZYCCD_HD std::uint32_t rest() const { return end - next; }
};

// One worker's side, for one thread of it. The order of calls:
//
//   arrive
//   claim; where it is empty: over() or cancelled(): leave, or claim again
//   copy the batch; release
//   work; where asked(): new_list, fill it, publish
//   with all own items done, claim again
template <class Atomics, class Item>
class GuidedWorker {
 public:
  using View = GuidedView<Atomics, Item>;

  LAZYCCD_HD void arrive(const View& view, std::uint32_t worker) {
    view_ = view;
    worker_ = worker;
    busy_ = false;
    steals_ = overflows_ = 0;
    // Relaxed, here and wherever hungry changes: it is a hint and publishes nothing.
    Atomics::fetch_add(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
  }

  // A portion of either list. Where both are empty the worker turns idle.
  //
  // Each list that is not used up holds one unit of `live`, which ends with its last portion. A
  // worker counts itself before it claims: the last portion may be another's, and be done with
  // first.
  LAZYCCD_HD Batch<Item> claim() {
    Batch<Item> batch = {nullptr, 0, no_chunk};
    if (promising()) {
      if (!busy_) view_.termination().chunk_published();
      batch = claim_initial();
      if (batch.count == 0) batch = claim_given();
      if (batch.count == 0 && !busy_) view_.termination().unit_ended();
    }
    const bool busy = batch.count != 0;
    if (busy && !busy_) {
      Atomics::fetch_sub(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
    } else if (!busy && busy_) {
      Atomics::fetch_add(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
      view_.termination().unit_ended();
    }
    busy_ = busy;
    return batch;
  }
  LAZYCCD_HD void release(const Batch<Item>& batch) {
    // Release, pairs with the acquire in new_list(): the portion has been copied.
    if (batch.chunk != no_chunk)
      Atomics::fetch_sub(view_.unread[batch.chunk].cell, batch.count, Atomics::release);
  }

  // Somebody waits and no list is in circulation.
  LAZYCCD_HD bool asked() const {
    // Relaxed: hints.
    return Atomics::load(view_.counters->idle_workers.cell, Atomics::relaxed) != 0 && given().rest() == 0;
  }

  // Room for the next list, or null where it is not this worker's turn.
  LAZYCCD_HD Item* new_list() {
    // Acquire, pairs with the releases in release() and publish().
    std::uint32_t nobody = 0;
    if (Atomics::load(view_.unread[worker_].cell, Atomics::acquire) != 0 ||
        !Atomics::compare_exchange(view_.counters->giving.cell, nobody, 1u, Atomics::acquire,
                                   Atomics::relaxed)) {
      ++overflows_;
      return nullptr;
    }
    // Only who gives makes the list longer, so what is empty now stays so.
    if (given().rest() == 0) return view_.list(worker_);
    Atomics::store(view_.counters->giving.cell, 0u, Atomics::release);
    return nullptr;
  }
  LAZYCCD_HD void publish(std::uint32_t count) {
    Atomics::store(view_.unread[worker_].cell, count, Atomics::relaxed);  // published below
    view_.termination().chunk_published();
    // Release, pairs with the acquire in claim_given(): the items.
    Atomics::store(view_.counters->given.cell, GivenList{worker_, 0, count}.pack(),
                   Atomics::release);
    Atomics::store(view_.counters->giving.cell, 0u, Atomics::release);
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
  LAZYCCD_HD GivenList given() const {
    return GivenList::unpack(Atomics::load(view_.counters->given.cell, Atomics::relaxed));
  }

  LAZYCCD_HD bool promising() const {
    // Relaxed: hints.
    return Atomics::load(view_.counters->claimed.cell, Atomics::relaxed) < view_.initial_count ||
           given().rest() != 0;
  }

  LAZYCCD_HD Batch<Item> claim_initial() {
    // Relaxed: the items were there before the run.
    std::uint64_t seen = Atomics::load(view_.counters->claimed.cell, Atomics::relaxed);
    while (seen < view_.initial_count) {
      std::uint32_t size = view_.portion(view_.initial_count - seen);
      if (size <= view_.least) {  // as all that follow, so none is refused
        seen = Atomics::fetch_add(view_.counters->claimed.cell, std::uint64_t{view_.least},
                                  Atomics::relaxed);
        if (seen >= view_.initial_count) break;
        size = view_.portion(view_.initial_count - seen);
      } else if (!Atomics::compare_exchange(view_.counters->claimed.cell, seen, seen + size,
                                            Atomics::relaxed, Atomics::relaxed)) {
        continue;
      }
      if (seen + size == view_.initial_count) view_.termination().unit_ended();
      return {view_.initial + seen, size, no_chunk};
    }
    return {nullptr, 0, no_chunk};
  }

  LAZYCCD_HD Batch<Item> claim_given() {
    // Acquire, pairs with the release in publish(): the items, also through other claims, which
    // continue the release sequence.
    std::uint64_t seen = Atomics::load(view_.counters->given.cell, Atomics::acquire);
    for (;;) {
      GivenList given = GivenList::unpack(seen);
      if (given.rest() == 0) return {nullptr, 0, no_chunk};
      const std::uint32_t size = view_.portion(given.rest()), first = given.next;
      given.next += size;
      if (!Atomics::compare_exchange(view_.counters->given.cell, seen, given.pack(),
                                     Atomics::acquire, Atomics::acquire))
        continue;
      if (given.worker != worker_) ++steals_;
      if (given.rest() == 0) view_.termination().unit_ended();
      return {view_.list(given.worker) + first, size, given.worker};
    }
  }

  View view_;
  std::uint32_t worker_;
  bool busy_;  // holds a unit of `live`
  std::uint64_t steals_;
  std::uint64_t overflows_;
};

}  // namespace lazyccd
