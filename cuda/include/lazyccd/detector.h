// The detector: finds every contact of a step in continuous time.
//
//   lazyccd::Detector detector;
//   detector.set_topology(topology);  // once, and after every change of the mesh
//   for (each step)
//     for (const lazyccd::Contact& c : detector.detect(start, end)) ...
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lazyccd/algorithm.h"
#include "lazyccd/contact.h"
#include "lazyccd/contact_columns.h"
#include "lazyccd/device.h"
#include "lazyccd/export.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"
#include "lazyccd/stats.h"
#include "lazyccd/threads.h"

namespace lazyccd {

/// Where detection runs. `automatic` takes the faster one if a device answers, otherwise the CPU:
/// it decides by the number of faces and by the times of earlier detections. If the device fails or
/// does not take a step, the CPU does that step; status() says why. The contacts are the same
/// on every backend.
enum class Backend { automatic, cpu, cuda };

/// What a user of the detector chooses. `algorithm` holds the switches that change only the cost.
struct DetectorOptions {
  Backend backend = Backend::automatic;
  int device = -1;  ///< index of the GPU, as CUDA numbers them; -1: the caller's current one
  int threads = 0;  ///< threads of the CPU backend; 0: as many as cores that the caller may use

  bool vertex_face = true;  ///< test vertices against faces
  bool edge_edge = true;    ///< test edges against edges

  /// Minimum separation, in the unit of the positions; 0: primitives must touch.
  /// A contact is where the distance falls to this value, or is below it at the start (then the
  /// time of impact is 0). Decided in double precision: never a miss and never late. A distance
  /// that rounding cannot tell from the separation counts as a contact. Keep it below the shortest
  /// edge, or set Topology::self_separation. Otherwise neighbours in one mesh are always in
  /// contact.
  double separation = 0;

  /// Report one contact if several pairs share the same closest points. A vertex above a vertex
  /// makes some fifty such pairs. Applies to pairs that are within the separation at the start, and
  /// needs both vertex_face and edge_edge.
  bool reduce_contacts = false;

  AlgorithmOptions algorithm;
};

/// Owns one scene and its buffers. Several detectors may work at the same time; one detector is not
/// thread-safe.
class LAZYCCD_API Detector {
 public:
  /// Throws Error(invalid_argument) if an option is outside its range.
  explicit Detector(const DetectorOptions& options = {});
  /// Uses the caller's threads in place of its own; DetectorOptions::threads is not read.
  Detector(const DetectorOptions& options, const Threads& threads);
  ~Detector();
  Detector(Detector&&) noexcept;
  Detector& operator=(Detector&&) noexcept;

  /// Tells the detector the primitives of the scene. Copies what it needs. If the topology is
  /// invalid, throws Error with the body and primitive at fault and keeps the old topology.
  void set_topology(const Topology& topology);

  /// Leaves out of the following detections all pairs of these edges with edges, and of these
  /// vertices with faces: those whose element is not 0. `edges`: as edges(); `vertices`: by vertex;
  /// empty: none. Holds until the next set_topology(). For pairs within a separation that need no
  /// answer, such as those with the flat edges of a terrain. Throws Error(size_mismatch), and
  /// Error(invalid_argument) without a separation.
  void leave_out(Span<const char> edges, Span<const char> vertices);

  /// Leaves out of the following detections all pairs of two of these bodies, and of each with
  /// itself: those whose element is not 0. By body; empty: none. Holds until the next
  /// set_topology(). For bodies at rest, whose contacts the caller has kept: pairs of them cost
  /// little. Cheap enough for every step, but another set discards what detect_ahead() started.
  /// Returns whether it is another one. Throws as leave_out().
  bool set_resting(Span<const char> bodies);

  /// Returns the contacts of the linear motion from `start` to `end`, sorted by world, then by
  /// operator< of Contact. The span is valid until the next call. Throws Error if a position is not
  /// finite or the number of positions is wrong.
  Span<const Contact> detect(const Positions& start, const Positions& end);

  /// Does the same for a caller that reads only some fields of the contacts: bits of ContactField.
  /// Less is copied from a GPU. The arrays are valid until the next call. Functions on the contacts
  /// of a world, and take_contacts(), have nothing afterwards.
  ContactColumns detect_columns(const Positions& start, const Positions& end, std::uint32_t fields);

  /// Enqueues a detection on the caller's stream: positions and contacts lie in device memory.
  /// Returns before the device has done it. Work that is enqueued on `stream` afterwards finds the
  /// contacts, until the next call. The positions must be unchanged until then. It waits for the
  /// device only after set_topology() and when lists grow.
  ///
  /// world_mask: by world, in device memory: bodies of a world with 0 are left out. Null: none are.
  ///
  /// If a list is too short, the contacts lack some and DeviceStatus::incomplete says so. Later
  /// calls make room as soon as they know; synchronize() completes the last one. On one stream
  /// after another, the later detection waits for the earlier one.
  ///
  /// Throws Error(unavailable) or Error(device) if there is no GPU; Error(invalid_argument) with a
  /// separation or normal cones, which only detect() knows.
  DeviceContacts detect_async(const DevicePositions& start, const DevicePositions& end,
                              CudaStream stream, const std::uint8_t* world_mask = nullptr);
  /// Waits for the last detect_async() and completes its contacts: a stage that lacked room runs
  /// again, and the host decides what the device cannot. Then stats() are those of this detection.
  /// Throws the Error of an invalid position; Error(device) if it is kTooLarge or the device fails.
  DeviceContacts synchronize();
  /// Does the same and copies the contacts to the host. They are valid until the next call.
  Span<const Contact> download_contacts();

  /// Hands over the contacts of the last detect(): without a copy on the CPU, with one on the GPU.
  /// The span that detect() returned is invalid afterwards. The memory of `reuse`, an earlier
  /// result that is no longer needed, serves later detections. Call it directly after detect(),
  /// once; later calls return nothing.
  std::vector<Contact> take_contacts(std::vector<Contact> reuse = {});

  /// Starts the next detect() on a worker thread while the caller goes on. `start` must equal the
  /// start of that detect() exactly, and every vertex must end within `tolerance` of `end` (in the
  /// unit of the positions, at most the separation). Otherwise the work is discarded. The result is
  /// the same either way. Both arrays must stay unchanged until detect(), detect_ahead() or
  /// set_topology() returns or the detector is destroyed. Has no effect on the GPU, with one
  /// thread, without a separation, with Strategy::static_list, or with a Volume other than box.
  void detect_ahead(const Positions& start, const Positions& end, double tolerance);

  /// By body: a lower bound of the distance of its primitives from all others at the start of the
  /// last detect(), in the unit of the positions. It is at most the separation. For a body that
  /// collides with itself, it is at most the separation of a pair with the smallest
  /// Topology::self_separation of its vertices. Pairs that are pinned, cannot collide, rest or are
  /// left out do not count. Needs a separation. Valid until the next detect().
  Span<const double> near_distances() const;

  /// Tests the pairs that the last detect() found within the separation h again, for another motion
  /// with the same start. Returns the pairs that touch, sorted; valid until the next call. Complete
  /// if can_recheck_any_motion(), or if at all times the deviations of any two vertices from the
  /// motion of that detect() add up to less than h. Within a body, h is that of a pair with
  /// the smallest Topology::self_separation of its vertices. Runs on the CPU with every backend.
  /// Throws Error after detect_ahead() has started, because that reuses the list of pairs, and
  /// after set_resting(); Error(device) if a GPU has the pairs and fails.
  Span<const Contact> recheck_near_pairs(const Positions& start, const Positions& end);
  /// Whether recheck_near_pairs() is complete for any motion: it searches again where vertices
  /// deviate by more than h. So it is after a detect() of the CPU with Volume::box, unless
  /// AlgorithmOptions::rebuild_every_step is set.
  bool can_recheck_any_motion() const;

  /// Number of worlds (Body::world), not counting -1. Some may be empty.
  std::int32_t world_count() const;
  /// Where the contacts of each world begin in the result of the last detect() or
  /// recheck_near_pairs(): those of world w are [offsets[w + 1], offsets[w + 2]). World -1 has the
  /// contacts between bodies that are in every world. Valid as long as the contacts. Takes memory
  /// for every world up to the largest.
  Span<const std::size_t> world_offsets();
  /// The contacts of one world. The same, bit for bit, as if the other worlds' bodies were left
  /// out, except that bodies, vertices and primitives keep their numbers. Throws
  /// Error(index_out_of_range).
  Span<const Contact> contacts_of_world(std::int32_t world);
  /// The contact_hash() of contacts_of_world() with the vertices numbered as if the other worlds'
  /// bodies were left out. So it is the same in a detection without them.
  std::uint64_t hash_of_world(std::int32_t world);

  /// All edges: the sides of the faces and the topology's own edges, each once. An edge is
  /// (smaller, larger) vertex index; the list is sorted by the larger index, then by the smaller.
  Span<const Edge> edges() const;

  const Stats& stats() const;  ///< of the last detection
  /// One line: the backend in use and, if it is not the one asked for, why.
  std::string status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// 64-bit hash over kind, vertices and time of impact of each contact. Does not depend on the
/// order.
LAZYCCD_API std::uint64_t contact_hash(Span<const Contact> contacts);

}  // namespace lazyccd
