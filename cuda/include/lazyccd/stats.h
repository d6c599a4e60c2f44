// What a detection did and what it cost.
#pragma once

#include <cstdint>
#include <string>

namespace lazyccd {

struct Stats {
  // Scene.
  std::int64_t vertices = 0, edges = 0, faces = 0, bodies = 0;
  std::int64_t groups = 0;  // leaves of the hierarchy: up to 16 faces with the vertices and edges they own

  // Work. A candidate is an elementary pair that reached the filter; a survivor one that left it.
  std::int64_t tree_tests = 0;    // pairs of tree nodes tested
  std::int64_t front_start = 0;   // cpu: pairs that the traversal started from: the root, or a front
  std::int64_t front_nodes = 0;   // pairs where the traversal ended (Algorithm 2.1's front)
  std::int64_t volume_culled = 0; // pairs of nodes whose boxes overlap and whose volumes do not
  std::int64_t group_pairs = 0;   // overlapping pairs of groups
  std::int64_t culled_by_normal_cone = 0;    // nodes not opened, because they cannot touch themselves
  std::int64_t candidates_vf = 0, candidates_ee = 0;
  std::int64_t orphan_tests = 0;       // of the candidates, those from the orphan sets
  // Candidates that the non-penetration filter ruled out; on the CPU 0 with a separation, where the
  // test itself does.
  std::int64_t filtered_noncoplanar = 0;
  std::int64_t survivors_vf = 0, survivors_ee = 0;
  std::int64_t double_precision_tests = 0;       // survivors that single precision could not decide
  std::int64_t exact = 0;         // survivors that only exact arithmetic could decide
  std::int64_t steals = 0;        // batches of work taken from another worker
  std::int64_t balancings = 0;    // static_list: balancing steps
  std::int64_t overflows = 0;     // times a full buffer was grown or worked around
  std::int64_t near = 0;          // with a separation: pairs that come as near, reported or not
  std::int64_t contacts_vf = 0, contacts_ee = 0;
  bool rebuilt = false;           // the hierarchy was built anew in this step
  bool front_reused = false;      // the traversal started from the front of an earlier step
  bool started_ahead = false;          // the start of the step was looked at before (Detector::detect_ahead())

  // Milliseconds: wall time, on the GPU device time. The CPU traverses, decides and waits at once: the
  // three share the wall time as the workers spent theirs. The GPU reports its stages only where they
  // are not replayed as one graph.
  double ms_upload = 0;    // cuda: positions to the device
  double ms_refit = 0;     // boxes and hierarchy, a rebuild included
  double ms_traverse = 0;  // traversal; cpu: and boxes of elementary pairs
  double ms_balance = 0;   // cpu: waiting for work
  double ms_leaf = 0;      // cuda: elementary boxes and filter
  double ms_narrow = 0;    // decisions; cpu: and filter
  double ms_front = 0;     // cpu: gathering the front
  double ms_sort = 0;      // contacts: gather, sort, hash
  double ms_download = 0;  // cuda: contacts to the host
  double ms_device = 0;    // cuda: positions resident to sorted contacts resident
  double ms_total = 0;     // wall time of the whole detection, without what was started_ahead

  std::uint64_t hash = 0;        // of the contacts; equal wherever the contacts are equal
  std::int64_t peak_bytes = 0;   // memory that the detector holds
  int threads = 0;
  double idle_share = 0;         // of the traversal's time, the part that workers waited for work
  std::string backend;           // "cpu" or "cuda"
  std::string device;            // the GPU's name and driver, or the CPU's instruction set
};

}  // namespace lazyccd
