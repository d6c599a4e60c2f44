// Guided self-scheduling: one list for all workers, taken in shrinking portions, without deques or
// stealing. When the list is empty and a worker is idle, a worker that has items publishes some of
// them as the next list. The same code runs on CPU threads and on CUDA blocks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "balance/chunk_pool.h"
#include "balance/termination.h"
#include "core/platform.h"

namespace lazyccd::research {

/// Returns the size of the next portion by guided self-scheduling (Polychronopoulos and Kuck 1987),
/// from 1 to 2^16. Portions are large at first, so there are few of them, and single items at the
/// end, so all workers finish together. Half of an even share is given: the other half is for
/// workers whose items turn out to be light.
LAZYCCD_HD inline std::uint32_t guided_size(std::uint64_t rest, std::uint32_t workers) {
  constexpr std::uint64_t max_size = 1u << 16;
  const std::uint64_t size = rest / (2 * std::uint64_t{workers});
  return static_cast<std::uint32_t>(size < 1 ? 1 : size < max_size ? size : max_size);
}

/// The state that the workers of a run share: a view. Zeroed memory is a run without work, except
/// for `live`, which starts as 1, the unit of the initial list.
template <class Atomics, class Item>
struct GuidedView {
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
    Hot<std::uint32_t> live;          // Termination
    Hot<std::uint64_t> claimed;       // initial items claimed so far; may exceed their number
    Hot<std::uint64_t> shared_list;   // the list in circulation: a SharedList
    Hot<std::uint32_t> list_lock;     // nonzero: a worker is making the next list
    Hot<std::uint32_t> idle_workers;  // number of workers that look for work
    Hot<std::uint32_t> cancelled;     // nonzero: stop
  };

  /// The largest number of items in a published list.
  static constexpr std::uint32_t max_list_size = 0xffff;

  std::uint32_t workers;
  std::uint32_t list_size;    // capacity of each worker's list, at most max_list_size
  std::uint32_t least, most;  // smallest (>= 1) and largest portion, in items
  Counters* counters;
  Spaced<std::uint32_t>* unread;  // one per worker: items of its list that are not copied yet
  Item* lists;                    // list_size per worker
  const Item* initial;
  std::uint64_t initial_count;

  LAZYCCD_HD Termination<Atomics> termination() const {
    return Termination<Atomics>(counters->live.cell);
  }
  LAZYCCD_HD Item* list(std::uint32_t worker) const {
    return lists + std::size_t{worker} * list_size;
  }
  /// The size of the next portion if `rest` items are left.
  LAZYCCD_HD std::uint32_t portion(std::uint64_t rest) const {
    const std::uint32_t size = guided_size(rest, workers);
    const std::uint32_t large = size > least ? size : least;
    const std::uint32_t bounded = large < most ? large : most;
    return bounded < rest ? bounded : static_cast<std::uint32_t>(rest);
  }
};

/// The list in circulation: the worker that made it, and the range [next, end) that is not claimed
/// yet. The worker whose CAS changes the word owns the portion. ABA is harmless here: the word has
/// the same meaning each time it has the same value.
struct SharedList {
  std::uint32_t worker, next, end;

  LAZYCCD_HD static SharedList unpack(std::uint64_t bits) {
    return {static_cast<std::uint32_t>(bits >> 32), static_cast<std::uint32_t>(bits >> 16 & 0xffff),
            static_cast<std::uint32_t>(bits & 0xffff)};
  }
  LAZYCCD_HD std::uint64_t pack() const {
    return std::uint64_t{worker} << 32 | std::uint64_t{next} << 16 | end;
  }
  LAZYCCD_HD std::uint32_t rest() const { return end - next; }
};

/// The protocol of one worker, called by one thread of it. The order of calls:
///
///   arrive
///   claim; if it is empty: leave if over() or cancelled(), otherwise claim again
///   copy the batch; release
///   process the items; if asked(): new_list, fill it, publish
///   when all own items are done: claim again
template <class Atomics, class Item>
class GuidedWorker {
 public:
  using View = GuidedView<Atomics, Item>;

  /// Joins the run as worker number `worker`. The worker starts idle.
  LAZYCCD_HD void arrive(const View& view, std::uint32_t worker) {
    view_ = view;
    worker_ = worker;
    busy_ = false;
    steals_ = overflows_ = 0;
    // Relaxed, here and wherever idle_workers changes: it is a hint and publishes nothing.
    Atomics::fetch_add(view_.counters->idle_workers.cell, 1u, Atomics::relaxed);
  }

  /// Claims a portion of the initial list or of the list in circulation. If both are empty, the
  /// worker becomes idle. The batch's `chunk` is the worker that made the list.
  ///
  /// Each list that is not used up holds one unit of `live`, which ends with its last portion. A
  /// worker counts itself before it claims, because another worker may claim the last portion and
  /// finish it first.
  LAZYCCD_HD Batch<Item> claim() {
    Batch<Item> batch = {nullptr, 0, no_chunk};
    if (may_have_items()) {
      if (!busy_) view_.termination().chunk_published();
      batch = claim_initial();
      if (batch.count == 0) batch = claim_shared();
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
  /// Reports that a batch has been copied.
  LAZYCCD_HD void release(const Batch<Item>& batch) {
    // Release: pairs with the acquire in new_list(). The portion has been copied.
    if (batch.chunk != no_chunk)
      Atomics::fetch_sub(view_.unread[batch.chunk].cell, batch.count, Atomics::release);
  }

  /// Whether a worker is idle and no list is in circulation.
  LAZYCCD_HD bool asked() const {
    // Relaxed: hints.
    return Atomics::load(view_.counters->idle_workers.cell, Atomics::relaxed) != 0 &&
           shared_list().rest() == 0;
  }

  /// Returns memory for the next list. Null if the worker's last list is not copied yet, another
  /// worker makes a list, or a list is in circulation. If not null, publish() must follow.
  LAZYCCD_HD Item* new_list() {
    // Acquire: pairs with the releases in release() and publish().
    std::uint32_t unlocked = 0;
    if (Atomics::load(view_.unread[worker_].cell, Atomics::acquire) != 0 ||
        !Atomics::compare_exchange(view_.counters->list_lock.cell, unlocked, 1u, Atomics::acquire,
                                   Atomics::relaxed)) {
      ++overflows_;
      return nullptr;
    }
    // Only the holder of the lock adds a list, so a list that is empty now stays empty.
    if (shared_list().rest() == 0) return view_.list(worker_);
    Atomics::store(view_.counters->list_lock.cell, 0u, Atomics::release);
    return nullptr;
  }
  /// Publishes the list of the last new_list(), which has `count` items.
  LAZYCCD_HD void publish(std::uint32_t count) {
    Atomics::store(view_.unread[worker_].cell, count, Atomics::relaxed);  // published below
    view_.termination().chunk_published();
    // Release: pairs with the acquire in claim_shared(), for the items.
    Atomics::store(view_.counters->shared_list.cell, SharedList{worker_, 0, count}.pack(),
                   Atomics::release);
    Atomics::store(view_.counters->list_lock.cell, 0u, Atomics::release);
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
  LAZYCCD_HD SharedList shared_list() const {
    return SharedList::unpack(Atomics::load(view_.counters->shared_list.cell, Atomics::relaxed));
  }

  LAZYCCD_HD bool may_have_items() const {
    // Relaxed: hints.
    return Atomics::load(view_.counters->claimed.cell, Atomics::relaxed) < view_.initial_count ||
           shared_list().rest() != 0;
  }

  LAZYCCD_HD Batch<Item> claim_initial() {
    // Relaxed: the items were there before the run.
    std::uint64_t seen = Atomics::load(view_.counters->claimed.cell, Atomics::relaxed);
    while (seen < view_.initial_count) {
      std::uint32_t size = view_.portion(view_.initial_count - seen);
      if (size <= view_.least) {  // so are all that follow: an addition, which cannot fail
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

  LAZYCCD_HD Batch<Item> claim_shared() {
    // Acquire: pairs with the release in publish(), for the items. This also holds after other
    // claims, because they continue the release sequence.
    std::uint64_t seen = Atomics::load(view_.counters->shared_list.cell, Atomics::acquire);
    for (;;) {
      SharedList list = SharedList::unpack(seen);
      if (list.rest() == 0) return {nullptr, 0, no_chunk};
      const std::uint32_t size = view_.portion(list.rest()), first = list.next;
      list.next += size;
      if (!Atomics::compare_exchange(view_.counters->shared_list.cell, seen, list.pack(),
                                     Atomics::acquire, Atomics::acquire))
        continue;
      if (list.worker != worker_) ++steals_;
      if (list.rest() == 0) view_.termination().unit_ended();
      return {view_.list(list.worker) + first, size, list.worker};
    }
  }

  View view_;
  std::uint32_t worker_;
  bool busy_;  // counted in `live` (Termination)
  std::uint64_t steals_;
  std::uint64_t overflows_;
};

}  // namespace lazyccd::research
