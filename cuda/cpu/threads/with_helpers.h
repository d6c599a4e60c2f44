// Who helps the caller of a pool for a while.
#pragma once

#include "cpu/threads/thread_pool.h"

namespace lazyccd {

// For as long as it lives; then everyone again.
class WithHelpers {
 public:
  WithHelpers(ThreadPool& pool, ThreadPool::Helpers helpers) : pool_(pool) {
    pool_.set_helpers(helpers);
  }
  ~WithHelpers() { pool_.set_helpers(ThreadPool::Helpers::everyone); }
  WithHelpers(const WithHelpers&) = delete;
  WithHelpers& operator=(const WithHelpers&) = delete;

 private:
  ThreadPool& pool_;
};

}  // namespace lazyccd
