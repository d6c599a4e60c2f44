// Model of the protocol of cuda/balance: deque.h, termination.h and the order of calls in
// lazy_stealing.h.
//
// Each access to shared memory in the code is one step here, so all interleavings are covered.
// Memory is sequentially consistent, so the memory orders are not covered: ThreadSanitizer checks
// those. A chunk holds one item. Free chunks come from an abstract pool in any order, so ids come
// back as soon as they can; free_list.pml models the real pool. An idle worker blocks instead of
// spinning, so that a run that would never end shows as an invalid end state.
//
// Each `#ifdef` is a mutant: a protocol with one mistake, which check.sh expects to be caught.

#ifndef WORKERS
#define WORKERS 2
#endif
#ifndef CHUNKS
#define CHUNKS 3   // ids in the pool
#endif
#ifndef RING
#define RING 2     // slots per deque, a power of two
#endif
#ifndef INITIAL
#define INITIAL 1  // items at the start
#endif
#ifndef ITEMS
#define ITEMS 5    // total number; busy workers make the others, at any time
#endif

#define MODULUS (2 * RING)  // for top and bottom; 2^16 in the code, at least twice any ring
#define NONE 255
#define size(t, b) ((b + MODULUS - t) % MODULUS)

typedef Deque { byte top, bottom, tag; byte slot[RING] }
Deque deque[WORKERS];
byte content[CHUNKS];
byte unclaimed = INITIAL;
byte live = INITIAL;

// Only the checker knows these.
mtype = { is_free, is_owned, is_published };
mtype state[CHUNKS] = is_free;
byte made = INITIAL;  // items 0 .. made-1
bool done[ITEMS];
byte done_count, busy_count;

inline load_word(d) { t = deque[d].top; b = deque[d].bottom; g = deque[d].tag }
#define unchanged(d) (deque[d].top == t && deque[d].bottom == b && deque[d].tag == g)

inline process() {
  assert(!done[item]);  // exactly once
  done[item] = true;
  done_count++
}

inline won() {
  assert(state[id] == is_published);  // so no other worker has it
  state[id] = is_owned
}

inline unit_ended() { assert(live > 0); live-- }

inline read_and_free() {
#ifdef FREE_BEFORE_READ
  state[id] = is_free;
  item = content[id];
#else
  item = content[id];
  state[id] = is_free;
#endif
  id = NONE
}

// new_chunk() and publish(). An item that finds no room is processed at once.
inline offer() {
  atomic { made < ITEMS -> item = made; made++ }
#ifdef ROOM_UNCHECKED
  room = true;
#else
  room = size(deque[me].top, deque[me].bottom) < RING;
#endif
  atomic {
    id = 0;
    do
    :: id < CHUNKS && room && state[id] == is_free -> state[id] = is_owned; break
    :: id < CHUNKS -> id++
    :: id == CHUNKS -> id = NONE; break
    od
  }
  if
  :: id == NONE -> process()
  :: else ->
    content[id] = item;
#ifndef COUNT_AFTER_PUBLISHING
    live++;
#endif
    atomic { load_word(me) }
    deque[me].slot[b % RING] = id;
    do
    :: atomic {
         if
         :: unchanged(me) ->
           deque[me].bottom = (b + 1) % MODULUS;
#ifndef NO_TAG
           deque[me].tag++;
#endif
           state[id] = is_published;
           id = NONE;
           break
         :: else -> load_word(me)
         fi
       }
    od;
#ifdef COUNT_AFTER_PUBLISHING
    live++;
#endif
  fi
}

inline pop() {
  atomic { load_word(me) }
  do
  :: t == b -> id = NONE; break
  :: else ->
    id = deque[me].slot[(b + MODULUS - 1) % RING];
    atomic {
      if
#ifdef POP_STORES
      :: true ->
        deque[me].top = t;
#else
      :: unchanged(me) ->
#endif
        deque[me].bottom = (b + MODULUS - 1) % MODULUS;
        won();
        break
#ifndef POP_STORES
      :: else -> load_word(me)
#endif
      fi
    }
  od
}

inline steal(victim) {
  atomic { deque[victim].top != deque[victim].bottom -> load_word(victim) }
  id = deque[victim].slot[t % RING];
  atomic {
    if
#ifdef CAS_OF_TOP_ALONE
    :: deque[victim].top == t ->
#else
    :: unchanged(victim) ->
#endif
      deque[victim].top = (t + 1) % MODULUS;
      won();
      busy_count++
    :: else -> id = NONE
    fi
  }
}

active [WORKERS] proctype worker() {
  byte me = _pid, id = NONE, item = NONE, t, b, g;
  bool busy, room;

own_batch:
  pop();
  if
  :: id != NONE -> skip
  :: else ->
    atomic {
      if
      :: unclaimed > 0 ->
        item = INITIAL - unclaimed;
        unclaimed--;
        if
        :: !busy -> busy_count++
        :: else
        fi
      :: else -> item = NONE
      fi
    }
  fi;
  if
  :: id == NONE && item == NONE -> goto become_idle
  :: else
  fi;
  if
  :: busy -> unit_ended()
  :: else -> busy = true
  fi;

work:
  if
  :: id != NONE -> read_and_free()
  :: else
  fi;
  atomic { process() };
  do
  :: offer()
  :: break
  od;
  item = NONE;
  goto own_batch;

become_idle:
  if
  :: busy ->
    busy = false;
#ifdef IDLE_BEFORE_LAST_PUSH
    unit_ended();
    if
    :: offer()
    :: true
    fi;
    busy_count--;
#else
    atomic { busy_count--; unit_ended() };
#endif
  :: else
  fi;

search:
  atomic { t = 0; b = 0; g = 0; item = NONE; room = false };
  do  // the own deque is empty and stays empty
  :: live == 0 -> break
  :: steal(0); if :: id != NONE -> busy = true; goto work :: else fi
  :: steal(1); if :: id != NONE -> busy = true; goto work :: else fi
#if WORKERS > 2
  :: steal(2); if :: id != NONE -> busy = true; goto work :: else fi
#endif
  od;

  // No worker leaves early, and no work is left undone.
  assert(busy_count == 0 && unclaimed == 0 && done_count == made)
}
