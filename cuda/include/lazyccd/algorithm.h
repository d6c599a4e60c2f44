// Switches of the algorithm, for research and tuning. They change the cost of a detection, never
// its contacts: those are the same, bit by bit, with every setting.
//
// LazyCCD::core has Strategy::lazy_stealing, Volume::box and the non-penetration filter. All else
// is in the library LazyCCD::research: see register_research().
//
// Papers cited here:
//   Arora et al. 1998, "Thread scheduling for multiprogrammed multiprocessors".
//   Curtis et al. 2008, "Fast collision detection for deformable models using
//     representative-triangles".
//   Lauterbach et al. 2010, "gProximity: Hierarchical GPU-based operations for collision and
//     distance queries".
//   da Silva, V., "Lazy Work Stealing for Continuous Hierarchy Traversal on Deformable Bodies",
//     M.Sc. dissertation, COPPE/UFRJ. Cited below as "da Silva".
//   Tang et al. 2008, "Fast continuous collision detection between deformable models using
//     subdivision-based hierarchical culling" (continuous normal cones).
//   Tang et al. 2009, "ICCD: Interactive continuous collision detection between deformable
//     models" (orphan sets).
//   Tang et al. 2010, "Fast continuous collision detection using deforming non-penetration
//     filters".
#pragma once

#include <cstdint>
#include <string>

#include "lazyccd/export.h"

namespace lazyccd {

/// How the traversal shares its work among threads or blocks.
enum class Strategy {
  lazy_stealing,  ///< Chunks of node pairs, stolen by idle workers. A busy CPU worker offers chunks
                  ///< while others are idle; a busy GPU block offers what does not fit its stack.
  lazy_stealing_greedy,  ///< da Silva, Algorithms 3.7 to 3.13, corrected: an idle worker takes one
                         ///< batch from every other deque and moves what it won little by little.
  static_list,           ///< gProximity's (da Silva, Algorithms 3.1 to 3.4): one list a worker; all
                         ///< lists are evened out once some workers are idle.
  task_stealing,     ///< Arora et al.'s (da Silva, Algorithms 3.5, 3.6): one deque a worker; pairs
                     ///< are stolen one by one.
  guided,            ///< Guided self-scheduling: one list for all, taken in shrinking portions.
  thread_per_query,  ///< One thread a group, from the root, without balancing: the baseline.
};
constexpr Strategy kStrategies[] = {Strategy::lazy_stealing, Strategy::lazy_stealing_greedy,
                                    Strategy::static_list,   Strategy::task_stealing,
                                    Strategy::guided,        Strategy::thread_per_query};

LAZYCCD_API const char* name(Strategy strategy);  ///< "lazy_stealing", ...
/// Throws Error(invalid_argument) that lists the names.
LAZYCCD_API Strategy parse_strategy(const std::string& name);

/// Whether the filter runs in single precision first. `double_only` skips it.
enum class Arithmetic { single_first, double_only };

/// Whether a traversal starts from the front of the last step instead of the root (da Silva,
/// section 3.3). A front saves at most half of the node tests and skips the upper levels of the
/// tree. `automatic`: on for the GPU, where each level waits for the one above; off for the CPU.
enum class FrontUse { automatic, off, on };

/// Bounding volume of the tree's nodes, updated in each step. Every node also has the axis-aligned
/// box over the step, which is tested first; the others are tested if the boxes overlap. On the GPU
/// the leaves always have the diagonal slabs too.
enum class Volume {
  box,
  dop18,         ///< with six diagonal slabs
  oriented_box,  ///< with a box along the principal axes of the vertices
};
constexpr Volume kVolumes[] = {Volume::box, Volume::dop18, Volume::oriented_box};

LAZYCCD_API const char* name(Volume volume);  ///< "box", ...
/// Throws Error(invalid_argument) that lists the names.
LAZYCCD_API Volume parse_volume(const std::string& name);

/// Tests that rule out pairs before the elementary test. Stats counts what each one did.
/// Representative triangles (Curtis et al. 2008) are not needed: each vertex and edge has one
/// owner.
struct Culling {
  /// Drops pairs whose points are never coplanar, by the signs of Bernstein coefficients (Tang et
  /// al. 2010). The paper's non-penetration filter is what the code calls the non-coplanar filter.
  /// With a separation the CPU has no such filter apart from the elementary test.
  bool non_penetration = true;
  /// Drops parts of a surface that cannot touch themselves, by continuous normal cones and the
  /// contour condition (Tang et al. 2008). Not with a separation.
  bool normal_cones = false;
  /// Takes the pairs that only adjacent faces have from a list made once (Tang et al. 2009). Not
  /// with a separation.
  bool orphan_sets = false;
};

/// Sizes of the traversal, and switches for tests and benches. A size of 0 means the default.
struct Tuning {
  int block_size = 0;      ///< GPU: threads of a block, a multiple of 32 up to 512
  int blocks = 0;          ///< GPU: number of blocks
  int chunk = 0;           ///< lazy_stealing*: pairs that change hands at once; GPU: 32, 128 or 256
                           ///< (lazy_stealing_greedy: up to 256)
  int stack = 0;           ///< pairs of a worker's own stack beyond which the oldest leave:
                           ///< lazy_stealing_greedy; GPU: also lazy_stealing and static_list
  int idle_threshold = 0;  ///< static_list: number of idle workers that ends a round
  int delay_ns = 0;        ///< random waits up to this many nanoseconds, to provoke races in tests
  std::uint32_t capacity_hint = 0;  ///< first capacity of every buffer; each grows if it must
  bool graph = true;  ///< replay a step as one CUDA graph; false: launch and time stage by stage
};

struct AlgorithmOptions {
  Strategy strategy = Strategy::lazy_stealing;
  Tuning tuning;
  FrontUse front = FrontUse::automatic;  ///< not with thread_per_query
  /// A reused front of n(f) pairs is remade from the root once n(f) / n(f - front_period) is less
  /// than front_ratio: it no longer grows, so it is probably deeper than needed (da Silva, section
  /// 3.3). front_period >= 1 steps; front_ratio > 0.
  int front_period = 10;
  double front_ratio = 1.02;
  Volume volume = Volume::box;
  Culling culling;
  Arithmetic arithmetic = Arithmetic::single_first;
  /// The hierarchy is rebuilt once its total box surface exceeds this multiple of that at the last
  /// build; > 0.
  double rebuild_ratio = 1.5;
  bool rebuild_every_step = false;
};

/// Makes all values of Strategy, Volume and Culling known to detectors that are made from now on.
/// In LazyCCD::research. Call it once, before the first Detector with such an option; more calls do
/// no harm. Without it, the constructor of Detector throws Error(unavailable), which names the
/// option.
LAZYCCD_RESEARCH_API void register_research();

}  // namespace lazyccd
