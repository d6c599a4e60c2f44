// Counters and times of one detection.
#pragma once

#include <cstdint>
#include <string>

namespace lazyccd {

/// Counters and times of the last detection. Counters are 0 if the stage did not run.
struct Stats {
  // Size of the scene.
  std::int64_t vertices = 0, edges = 0, faces = 0, bodies = 0;
  /// Leaves of the hierarchy. A group has up to 16 faces with the vertices and edges that it owns.
  std::int64_t groups = 0;

  // Work. A candidate is an elementary pair that reached the filter; a survivor passed it.
  // _vf: vertex-face pairs; _ee: edge-edge pairs.
  std::int64_t tree_tests = 0;  ///< pairs of tree nodes tested
  /// CPU: pairs the traversal started from: the root, or a front. If the step was started ahead
  /// and its traversal interrupted: the number of pairs that were left over.
  std::int64_t front_start = 0;
  std::int64_t front_nodes = 0;  ///< pairs where the traversal ended (da Silva, Algorithm 2.1)
  /// Pairs of nodes whose boxes overlap but whose volumes do not.
  std::int64_t culled_by_volume = 0;
  std::int64_t group_pairs = 0;            ///< overlapping pairs of groups
  std::int64_t culled_by_normal_cone = 0;  ///< nodes not opened: they cannot touch themselves
  std::int64_t candidates_vf = 0, candidates_ee = 0;
  /// CPU: candidates that a Verlet list of an earlier step had.
  std::int64_t listed_candidates = 0;
  std::int64_t orphan_tests = 0;  ///< candidates that came from the orphan sets
  /// Candidates that the non-penetration filter ruled out. Always 0 on the CPU with a separation:
  /// there the filter is a part of the elementary test.
  std::int64_t filtered_noncoplanar = 0;
  std::int64_t survivors_vf = 0, survivors_ee = 0;
  std::int64_t double_precision_tests = 0;  ///< survivors that single precision could not decide
  std::int64_t exact_tests = 0;             ///< survivors that only exact arithmetic could decide
  std::int64_t steals = 0;                  ///< batches of work taken from another worker
  std::int64_t balancings = 0;              ///< static_list: balancing steps
  std::int64_t overflows = 0;  ///< number of times that a full buffer was grown or worked around
  /// GPU: parts in which the pairs of groups were tested because memory was short; 0: all at once.
  std::int64_t parts = 0;
  /// With a separation: pairs that come within their separation in the step, reported or not.
  std::int64_t near_pairs = 0;
  std::int64_t contacts_vf = 0, contacts_ee = 0;
  bool rebuilt = false;       ///< the hierarchy was rebuilt in this step
  bool front_reused = false;  ///< the traversal started from the front of an earlier step
  /// recheck_near_pairs(): the motion deviated so much that other pairs were tested too.
  bool searched_again = false;
  bool started_ahead = false;  ///< the detection continued what detect_ahead() had started

  // Times, milliseconds: wall time on the CPU, device time on the GPU. The CPU traverses, decides
  // and waits at the same time. So ms_traverse, ms_narrow and ms_balance share the wall time in the
  // proportion in which the workers spent theirs. The GPU reports its stages only if they are not
  // replayed as one graph (Tuning::graph).
  double ms_upload = 0;    ///< GPU: copy of the positions to the device
  double ms_refit = 0;     ///< boxes and hierarchy, a rebuild included
  double ms_traverse = 0;  ///< traversal; CPU: with the boxes of elementary pairs
  double ms_balance = 0;   ///< CPU: waiting for work
  double ms_leaf = 0;      ///< GPU: boxes of elementary pairs, and the filter
  double ms_narrow = 0;    ///< elementary tests; CPU: with the filter
  double ms_front = 0;     ///< CPU: gathering the front
  double ms_sort = 0;      ///< gathering, sorting and hashing the contacts
  double ms_download = 0;  ///< GPU: copy of the contacts to the host
  double ms_device = 0;    ///< GPU: from positions on the device to sorted contacts on the device
  double ms_total = 0;     ///< wall time of the whole detection, without what was started ahead

  std::uint64_t hash = 0;       ///< contact_hash() of the contacts
  std::int64_t peak_bytes = 0;  ///< memory that the detector holds, bytes
  int threads = 0;              ///< threads of the CPU backend
  double idle_share = 0;        ///< part of the traversal's time that workers waited, in [0, 1]
  std::string backend;          ///< "cpu" or "cuda"
  std::string device;           ///< the GPU's name and driver, or the CPU's instruction set
};

}  // namespace lazyccd
