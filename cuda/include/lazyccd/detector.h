// Finds every contact of a step in continuous time.
//
//   lazyccd::Detector detector;
//   detector.set_topology(topology);                      // once, and after every cut
//   for (each step)
//     for (const lazyccd::Contact& c : detector.detect(start, end)) ...
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "lazyccd/contact.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"
#include "lazyccd/stats.h"

namespace lazyccd {

// automatic: cuda where a device answers, else cpu. Where the device fails, in a step or from the
// start, the CPU does the work and status() says why; the contacts are the same.
enum class Backend { automatic, cpu, cuda };

// Whether single precision filters first. The contacts are the same, bit by bit.
enum class Arithmetic { single_first, double_only };

// Whether a traversal starts from the front of the last step or from the root. A front saves at most
// half of the tests (a binary tree has one inner pair for each pair of its front) and the way down the
// levels; automatic: on the GPU, where each level waits for the one above, not on the CPU.
enum class FrontUse { automatic, off, on };

// How the traversal spreads its work. The contacts are the same.
enum class Strategy {
  lazy_stealing,         // chunks of pairs; whoever has none steals, whoever has some offers: on the CPU
                         // on demand, on the GPU what its stack has too much of
  lazy_stealing_greedy,  // the dissertation's (Algorithms 3.7 to 3.13): an idle worker takes from all
                         // at once and moves what it won little by little
  static_list,           // gProximity's (3.1 to 3.4): a list a worker, all evened out once some are idle
  task_stealing,         // of Arora et al. (3.5, 3.6): a deque a worker, pairs stolen one by one
  guided,                // one list for all, taken in shrinking portions, refilled once it is empty
  thread_per_query,      // a group a thread, from the root and on its own: the baseline
};
constexpr Strategy kStrategies[] = {Strategy::lazy_stealing, Strategy::lazy_stealing_greedy,
                                    Strategy::static_list,   Strategy::task_stealing,
                                    Strategy::guided,        Strategy::thread_per_query};

const char* name(Strategy strategy);  // "lazy_stealing", ...
// Throws Error(invalid_argument) that lists the names.
Strategy parse_strategy(const std::string& name);

// Sizes of the traversal, for tests and benches. 0: the default.
struct Tuning {
  int block_size = 0;  // cuda: threads of a block, a multiple of 32 up to 512
  int blocks = 0;      // cuda
  int chunk = 0;       // lazy_stealing*: pairs that change hands at once; cuda: 32, 128 or 256
                       // (lazy_stealing_greedy: up to 256)
  int stack = 0;       // lazy_stealing_greedy; cuda: lazy_stealing and static_list too: pairs of a
                       // worker's own stack beyond which the oldest leave
  int idle_threshold = 0;  // static_list: workers that have run dry when a round ends
  int delay_ns = 0;    // random waits of up to this time, to shake out races
  std::uint32_t capacity_hint = 0;  // of every buffer at first; each grows where it must
  bool graph = true;   // replay a step as one CUDA graph; without, the stages are timed one by one
};

// Bounding volumes of the tree's nodes, made anew each step. All have the axis-aligned box over the
// step, which is tested first; the others are tested where boxes overlap. On the GPU the leaves have
// the diagonal slabs with each.
enum class Volume {
  box,
  dop18,         // and six diagonal slabs
  oriented_box,  // and a box along the principal axes of the vertices
};
constexpr Volume kVolumes[] = {Volume::box, Volume::dop18, Volume::oriented_box};

const char* name(Volume volume);  // "box", ...
// Throws Error(invalid_argument) that lists the names.
Volume parse_volume(const std::string& name);

// What is ruled out before its elementary test, apart from bounding volumes. The contacts are the same
// with and without; Stats says what each did. Representative features (Curtis et al. 2008) are not
// among them: each vertex and edge has one owner, so there is nothing to cull.
struct Culling {
  // Elementary pairs whose points are never coplanar, by the signs of Bernstein coefficients (Tang et
  // al. 2010). With a separation the CPU has no such filter apart from the test.
  bool non_penetration = true;
  // Parts of a surface that cannot touch themselves, by continuous normal cones and the contour
  // condition (Tang et al. 2008). Not with a separation.
  bool normal_cones = false;
  // Elementary pairs that only adjacent faces have are tested from a list, not found (Tang et al. 2009).
  // Not with a separation.
  bool orphan_sets = false;
};

struct Options {
  Backend backend = Backend::automatic;
  int threads = 0;                       // of the CPU backend; 0: as many as the machine has
  bool vertex_face = true;               // kinds of elementary test to run
  bool edge_edge = true;
  // Minimum separation (thickness), in the unit of the positions: contact is where the distance reaches
  // it from above, or is below it at the start (time of impact 0). 0: where primitives touch. Decided in
  // double precision: never a miss, never late, and what cannot be told from it counts as it. It should
  // stay below the shortest edge, or neighbours in one mesh are in contact all the time.
  double separation = 0;
  // Of pairs that are within the separation where the step begins, with their closest points on an
  // edge or a vertex, every face and edge that meets there makes one. True: of these the pairs of a
  // vertex and the first face there are enough, where they come as near. Where both kinds of test
  // run.
  bool distinct = false;
  Arithmetic arithmetic = Arithmetic::single_first;
  Volume volume = Volume::box;
  Culling culling;
  Strategy strategy = Strategy::lazy_stealing;
  Tuning tuning;
  FrontUse front = FrontUse::automatic;  // of lazy_stealing
  // A reused front f is outdated, and made anew from the root, once n(f) / n(f - period) < ratio:
  // it no longer grows, so it is likely to be deeper than it need be (dissertation, section 3.3).
  int front_period = 10;
  double front_ratio = 1.02;
  double rebuild_ratio = 1.5;     // total box surface over that at the last build that calls for a rebuild
  bool rebuild_every_step = false;
};

// One detector owns one scene and its buffers; several may work at once. Not thread-safe by itself.
class Detector {
 public:
  explicit Detector(const Options& options = {});
  ~Detector();
  Detector(Detector&&) noexcept;
  Detector& operator=(Detector&&) noexcept;

  // Throws Error, naming body and primitive, and keeps the old topology.
  void set_topology(const Topology& topology);

  // Contacts of the linear motion from `start` to `end`, sorted (operator< in contact.h). The span is
  // valid until the next call. Throws Error on non-finite positions or a wrong count.
  Span<const Contact> detect(const Positions& start, const Positions& end);

  // Announces the next detect(), with a minimum separation: a thread of the CPU backend begins with
  // it while the caller goes on. What is near where the step begins is found before detect(), where
  // `start` is what that is given, exactly, and no vertex ends further than `tolerance` from
  // `end`; else all is done anew. The contacts are the same. The positions are to stay as they are
  // until the next foresee(), detect() or set_topology() returns, or the detector is gone. Until
  // that detect(), touching_again() is over, and throws Error where anything was begun. Nothing is
  // begun on the GPU, with one thread, Strategy::static_list or another Volume than the box, or
  // where the tolerance is more than the separation.
  void foresee(const Positions& start, const Positions& end, double tolerance);

  // Of all pairs that came within the separation h in the last detect(), those that touch during
  // this motion, which begins where that one began; sorted. Nothing else can touch in a motion that
  // takes vertices of no two primitives by h or more together from where they were at any time of
  // that one, as where none goes h / 2. The CPU does it on every backend. The span is valid until
  // the next call of this function.
  Span<const Contact> touching_again(const Positions& start, const Positions& end);

  // All edges: sides of faces and the topology's own, each once, (smaller, larger) vertex index,
  // sorted by the larger and then by the smaller.
  Span<const Edge> edges() const;

  // body(first, last) over disjoint pieces of [0, count) of at most `grain`, on the threads of the
  // CPU backend: for what an application does around a detection, like reading positions. All in
  // one piece on the caller's thread where no other one comes: with one thread, or where all sleep,
  // whom a count of up to three times the grain does not wake. One that foresees comes when it has
  // done so. Rethrows the first exception.
  void parallel_for(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t first, std::size_t last)>& body);

  const Stats& stats() const;  // of the last detection
  // One line: the backend in use and, where it is not the one asked for, why.
  std::string status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Order-independent 64-bit hash over kind, vertices and time of impact of each contact.
std::uint64_t contact_hash(Span<const Contact> contacts);

}  // namespace lazyccd
