#include "lazyccd/threads.h"

#include <algorithm>

#include "host/threads/phases.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/error.h"
#include "simd/float_environment.h"

namespace lazyccd {

Threads::Threads(int count) : pool_(std::make_shared<std::unique_ptr<ThreadPool>>()) {
  if (count < 0)
    throw Error(ErrorCode::invalid_argument,
                "threads is negative; 0 means as many as there are cores");
  count_ = ThreadPool::resolve(count);
  gives_way_ = count == 0;
}

ThreadPool& Threads::pool() const {
  if (!*pool_) {
    *pool_ = std::make_unique<ThreadPool>(count_);
    (*pool_)->set_gives_way(gives_way_);
  }
  return **pool_;
}

void Threads::set_caller_only(bool caller_only) const { pool().set_caller_only(caller_only); }

bool Threads::is_caller_only() const { return pool().is_serial(); }

void Threads::parallel_for(std::size_t count, std::size_t grain,
                           FunctionRef<void(std::size_t, std::size_t)> body) const {
  const bool is_small = count / 3 + (count % 3 != 0) <= grain;
  const ScopedWakePolicy policy(
      pool(), is_small ? ThreadPool::WakePolicy::awake : ThreadPool::WakePolicy::everyone);
  // A small range is split finer: awake workers may come late, and data that one core wrote is slow
  // to read from another, so each worker takes as much as it gets to.
  const std::size_t range = is_small && count > grain ? std::max<std::size_t>(grain / 4, 1) : grain;
  // The environment is read only if another thread may need it: to read it takes as long as a short
  // range.
  if (pool().available() == 1 || count <= range) {
    if (count > 0) body(0, count);
    return;
  }
  const FloatEnvironment caller_mode;
  pool().parallel_for(count, range, [&](std::size_t first, std::size_t last, int worker) {
    if (worker == 0) return body(first, last);
    const WithFloatEnvironment mode(caller_mode);
    body(first, last);
  });
}

void Threads::run_phases(std::size_t count, FunctionRef<void(std::size_t, int)> run,
                         FunctionRef<std::size_t()> next) const {
  Phases phases(run, next);
  phases.start(pool(), count);
}

}  // namespace lazyccd
