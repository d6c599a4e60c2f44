// Model of the list of free chunks, FreeList in cuda/balance/chunk_pool.h: a linked stack whose
// head carries a tag. One CAS takes or gives several ids. Each access to shared memory is one step.
//
// NO_TAG is the mutant: a taker stalls between reading the links and its CAS, and the head leaves
// and comes back meanwhile. The taker then hands out ids that others hold.

#ifndef WORKERS
#define WORKERS 2
#endif
#ifndef IDS
#define IDS 3  // see link
#endif
#ifndef ROUNDS
#define ROUNDS 2  // takes per worker
#endif
#define MOST 2    // largest number of ids taken at once
#define NONE 255

byte head = 0, tag = 0;  // one word
byte link[IDS] = { 1, 2, 3 };

// Only the checker knows this.
bool held[IDS];

#define unchanged (head == first && tag == g)
#ifdef NO_TAG
#define bump skip
#else
#define bump tag++
#endif

inline take() {
  atomic { first = head; g = tag };
  do
  :: count = 0; next = first;
    do
    :: count < MOST && next < IDS -> ids[count] = next; count++; next = link[next]
    :: else -> break
    od;
    if
    :: count == 0 -> break
    :: else
    fi;
    atomic {
      if
      :: unchanged ->
        head = next; bump;
        assert(!held[ids[0]]); held[ids[0]] = true;
        if
        :: count > 1 -> assert(!held[ids[1]]); held[ids[1]] = true
        :: else
        fi;
        break
      :: else -> first = head; g = tag
      fi
    }
  od
}

// Gives back ids[from .. from+n-1].
inline give(from, n) {
  atomic {
    held[ids[from]] = false;
    if :: n > 1 -> held[ids[from + 1]] = false :: else fi
  };
  if :: n > 1 -> link[ids[from]] = ids[from + 1] :: else fi;
  atomic { first = head; g = tag };
  do
  :: link[ids[from + n - 1]] = first;
    atomic {
      if
      :: unchanged -> head = ids[from]; bump; break
      :: else -> first = head; g = tag
      fi
    }
  od
}

byte at_home;

active [WORKERS] proctype worker() {
  byte ids[MOST], first, g, next, count, round;
  do
  :: round < ROUNDS ->
    take();
    // Given back at once or in two parts, as the private caches do.
    if
    :: count == 0
    :: count == 1 -> give(0, 1)
    :: count == 2 -> give(0, 2)
    :: count == 2 -> give(1, 1); give(0, 1)
    :: count == 2 -> give(0, 1); give(1, 1)
    fi;
    round++
  :: else -> break
  od;
  atomic {
    at_home++;
    if
    :: at_home == WORKERS ->  // all ids must be back, each once
      first = head; count = 0;
      do
      :: first < IDS && count <= IDS -> count++; first = link[first]
      :: else -> break
      od;
      assert(count == IDS)
    :: else
    fi
  }
}
