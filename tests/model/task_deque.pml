// Model of the task deque, cuda/research/protocols/task_deque.h (Arora, Blumofe and Plaxton 2001): one owner
// and several thieves.
//
// Each access to shared memory in the code is one step here, so all interleavings are covered. The
// owner pushes tasks and pops up to MOST at once, in any order, until all are made and the deque is
// empty.
//
// Each `#ifdef` is a mutant: a protocol with one mistake, which check.sh expects to be caught.

#ifndef THIEVES
#define THIEVES 2
#endif
#ifndef CAPACITY
#define CAPACITY 2
#endif
#ifndef TASKS
#define TASKS 4
#endif
#ifndef MOST
#define MOST 1
#endif

#define NONE 255

byte top, tag, bottom;
byte slot[CAPACITY];

// Only the checker knows these.
bool taken[TASKS];
byte taken_count;
bool closed;

inline take(t) {
  atomic {
    assert(!taken[t]);  // exactly once
    taken[t] = true;
    taken_count++
  }
}

inline use_anew() {
  top = 0;
#ifndef NO_TAG
  tag = seen_tag + 1
#endif
}

inline take_slots(first, end) {  // only the owner writes there
  atomic {
    i = first;
    do
    :: i < end -> take(slot[i]); i++
    :: else -> break
    od
  }
}

active proctype owner() {
  byte made, b, end, seen_top, seen_tag, i;
  bool mine;
  do
  :: made < TASKS && bottom < CAPACITY ->  // push
    slot[bottom] = made;
    made++;
    bottom++
  :: made == TASKS && bottom == 0 -> break
  :: bottom > 0 ->  // pop
    end = bottom;
    b = (end > MOST -> end - MOST : 0);
#ifdef AGE_BEFORE_BOTTOM
    atomic { seen_top = top; seen_tag = tag };
    bottom = b;
#else
    bottom = b;
    atomic { seen_top = top; seen_tag = tag };
#endif
    if
#ifdef LAST_UNCHECKED
    :: b >= seen_top -> take_slots(b, end)
#else
    :: b > seen_top -> take_slots(b, end)
#endif
    :: else ->
      bottom = 0;
      mine = false;
      atomic {
        if
        :: end > seen_top && top == seen_top && tag == seen_tag ->
          take_slots(seen_top, end);
          use_anew();
          mine = true
        :: else -> seen_top = top
        fi
      };
      if
      :: mine
      :: else ->
        atomic { use_anew() };
        take_slots(seen_top, end)
      fi
    fi
  od;
  closed = true
}

active [THIEVES] proctype thief() {
  byte seen_top, seen_tag, seen_bottom, task;
  do
  :: closed -> break
  :: atomic { seen_top = top; seen_tag = tag };
    seen_bottom = bottom;
    if
    :: seen_bottom <= seen_top
    :: else ->
      task = slot[seen_top];
      atomic {
        if
        :: top == seen_top && tag == seen_tag ->
          top++;
          take(task)
        :: else
        fi
      }
    fi
  od
}

active proctype end_of_run() {
  closed;
  // Nothing is left undone. A thief counts what it has won in the same step.
  assert(taken_count == TASKS)
}
