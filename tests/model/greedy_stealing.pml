// Model of the batches of cuda/research/protocols/greedy_stealing.h: which worker may write or read a batch,
// and when the run is over. The deque is checked separately in lazy_stealing.pml; here each of its
// operations is one step.
//
// A worker's batches are its own memory. A taker reads a batch only when it has nothing else, and
// gives it back through `in_use`. A batch holds one item.
//
// Each `#ifdef` is a mutant: a protocol with one mistake, which check.sh expects to be caught.

#ifndef WORKERS
#define WORKERS 3
#endif
#ifndef BATCHES
#define BATCHES 2  // per worker
#endif
#ifndef ITEMS
#define ITEMS 5    // total number; busy workers make the others
#endif

#define NONE 255
#define ALL (WORKERS * BATCHES)

typedef Queue { byte count; byte id[BATCHES] }
Queue deque[WORKERS];
bool in_use[ALL];
byte content[ALL];
byte live = 1;  // the first item is unclaimed
bool unclaimed = true;

// Only the checker knows these.
byte made = 1, done_count, busy_count;
bool done[ITEMS];
bool written[ALL];  // written and not yet read

inline process() {
  atomic {
    assert(!done[item]);  // exactly once
    done[item] = true;
    done_count++
  }
}

inline take_oldest(v) {
  id = deque[v].id[0];
  deque[v].count--;
  deque[v].id[0] = deque[v].id[1]
}

// new_batch() and publish(). Without a free batch, the item is processed at once.
inline offer() {
  atomic { made < ITEMS -> item = made; made++ }
  i = 0;
  do
  :: i < BATCHES && !in_use[me * BATCHES + i] -> break
  :: i < BATCHES && in_use[me * BATCHES + i] -> i++
  :: i == BATCHES -> break
  od;
  if
  :: i == BATCHES -> process()
  :: else ->
    in_use[me * BATCHES + i] = true;
    atomic {
      assert(!written[me * BATCHES + i]);  // no worker has yet to read it
      content[me * BATCHES + i] = item;
      written[me * BATCHES + i] = true
    };
    live++;
    atomic {
      deque[me].id[deque[me].count] = me * BATCHES + i;
      deque[me].count++
    }
  fi
}

inline read_and_release() {
#ifdef RELEASE_BEFORE_READ
  in_use[id] = false;
  atomic { item = content[id]; written[id] = false }
#else
  atomic { item = content[id]; written[id] = false };
  in_use[id] = false
#endif
}

active [WORKERS] proctype worker() {
  byte me = _pid, id = NONE, item = NONE, i, v, won_count;
  byte won[WORKERS];
  bool busy;

own_batch:
  id = NONE;
  item = NONE;
  atomic {
    if
    :: deque[me].count > 0 -> deque[me].count--; id = deque[me].id[deque[me].count]
    :: else
    fi
  };
  if
  :: id == NONE && won_count > 0 -> won_count--; id = won[won_count]
  :: else
  fi;
  if
  :: id == NONE ->
    atomic {
      if
      :: unclaimed -> unclaimed = false; item = 0
      :: else
      fi
    }
  :: else
  fi;
  if
  :: id == NONE && item == NONE -> goto idle
  :: else
  fi;
  if
  :: busy -> live--
  :: else -> busy = true; busy_count++
  fi;
  if
  :: id != NONE -> read_and_release()
  :: else
  fi;
  process();
  do
  :: offer()
  :: break
  od;
  goto own_batch;

idle:
  if
  :: busy -> atomic { busy = false; busy_count--; live-- }
  :: else
  fi;
  atomic { id = NONE; item = NONE; i = 0 };
  do
  :: live == 0 -> break
  :: live != 0 ->  // steals one batch from each other deque
    v = 0;
    do
    :: v < WORKERS ->
      atomic {
        if
        :: v != me && deque[v].count > 0 ->
          take_oldest(v);
          won[won_count] = id;
          won_count++;
#ifdef WON_DOES_NOT_COUNT
          live--
#endif
        :: else
        fi
      };
      v++
    :: else -> break
    od;
    id = NONE;
    if
    :: won_count > 0 ->
#ifdef WON_DOES_NOT_COUNT
      live = live + won_count;
#endif
      goto own_batch
    :: else
    fi
  od;

  // No worker leaves early, and no work is left undone.
  assert(busy_count == 0 && !unclaimed && done_count == made)
}
