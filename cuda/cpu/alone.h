// A pool whose caller does all by itself for a while.
#pragma once

#include "cpu/thread_pool.h"

namespace lazyccd {

// For as long as it lives, if so.
class Alone {
 public:
  Alone(ThreadPool& pool, bool alone) : pool_(pool) { pool_.set_alone(alone); }
  ~Alone() { pool_.set_alone(false); }
  Alone(const Alone&) = delete;
  Alone& operator=(const Alone&) = delete;

 private:
  ThreadPool& pool_;
};

}  // namespace lazyccd
