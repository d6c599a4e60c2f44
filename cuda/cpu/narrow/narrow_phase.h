// The narrow phase of one worker: from candidates to contacts.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "core/narrow/contact_key.h"
#include "core/narrow/contact_math.h"
#include "cpu/narrow/excluded_pairs.h"
#include "cpu/verlet/verlet_list.h"
#include "host/kernels/leaf_kernels.h"
#include "host/scene/mesh.h"
#include "lazyccd/contact.h"
#include "lazyccd/debug/stopwatch.h"
#include "lazyccd/export.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// Pairs that one worker found within the separation during the step.
struct NearPairs {
  std::vector<Candidate> of[2];  // by ContactKind
  // By body: lower bound of the distance of all of its pairs at the start of the step, unscaled.
  // Empty if there is no pair.
  std::vector<double> min_distance;

  void clear() {
    for (std::vector<Candidate>& pairs : of) pairs.clear();
    min_distance.clear();
  }
  std::size_t bytes() const {
    return (of[0].capacity() + of[1].capacity()) * sizeof(Candidate) +
           min_distance.capacity() * sizeof(double);
  }
};

/// Filters candidates, decides the survivors, and describes the contacts. Full queues of the sink
/// are processed at once. One thread at a time.
class NarrowPhase : public CandidateSink {
 public:
  NarrowPhase() { drain = &drain_full; }

  /// Starts a step. All arguments must stay valid until its end. Adds candidates to `listed`, a
  /// part of the Verlet list `list`, unless `list` is null.
  void begin(const LeafKernels& kernels, const Mesh& mesh, const LeafScene& scene,
             const VerletList* list, ListedPairs* listed);
  /// Limits the step to work that depends on its start only, because the end is not known yet
  /// (Detector::detect_ahead()). Candidates that are not certainly within the separation at the
  /// start go to `deferred`. The description of pairs that may touch at the start is deferred too.
  /// After `interrupted` becomes true, all further candidates go to `pending`.
  void limit_to_start(const std::atomic<bool>& interrupted) { interrupted_ = &interrupted; }
  /// Continues the same step with the end known. Afterwards the caller processes `pending`, then
  /// `deferred`.
  void resume(const LeafScene& scene);
  /// Adds no more candidates to the Verlet list. Call stop_listing() before the deferred candidates
  /// are processed, because the Verlet list has them already.
  void stop_listing() { list_ = nullptr; }
  /// Skips these candidates from now on, because the caller tests them separately. Null: none.
  void exclude(const ExcludedPairs* excluded) { excluded_ = excluded; }

  LAZYCCD_API void push(ContactKind kind, Candidate pair);
  /// Processes at most CandidateQueue::capacity candidates of the queue of any worker. May change
  /// `items`.
  void process_queued(ContactKind kind, Candidate* items, int count);
  /// Processes those of at most CandidateQueue::capacity listed candidates that can come within the
  /// separation in this step.
  void process_listed(const ListedPairs& part, ContactKind kind, const ListedCandidate* items,
                      int count);

  /// Forgets the contacts, because the caller keeps them. Their number still counts in `found`.
  void forget_contacts() {
    contacts.clear();
    keys.clear();
  }

  const LeafScene& scene() const { return scene_; }

  // Results and counters of this step.
  std::vector<Contact> contacts;
  std::vector<std::uint64_t> keys;                                   // sort keys of the contacts
  std::int64_t candidates[2] = {}, survived[2] = {}, found[2] = {};  // by ContactKind
  std::int64_t listed_candidates = 0;  // number of candidates from the Verlet list
  std::int64_t filtered_noncoplanar = 0, double_precision_tests = 0, exact_tests = 0;
  double ms = 0;                                   // time spent in the narrow phase, milliseconds
  std::vector<Candidate> deferred[2], pending[2];  // by ContactKind; see limit_to_start()
  // Result of the last step with a separation.
  NearPairs near_pairs;

  std::size_t bytes() const;

 private:
  static void drain_full(CandidateSink& self, ContactKind kind);
  void process(ContactKind kind, const Candidate* items, int count);
  template <ContactKind kind>
  void process_kind(const Candidate* items, int count);

  bool all_pinned(const Contact& contact) const;
  QueryCoordinates coordinates(const Contact& contact) const;
  void count(const Contact& contact);

  template <ContactKind kind>
  void report_touching(const Survivor& survivor);
  template <ContactKind kind>
  Decision decide(const Survivor& survivor, const QueryCoordinates& q);

  template <ContactKind kind>
  void report_near(const Candidate* items, int count);
  template <ContactKind kind>
  int copy_movable(const Candidate* items, int count);
  template <ContactKind kind>
  void list_near();
  template <ContactKind kind>
  void drop_resting();
  void defer_undecided(ContactKind kind);
  void defer_touching(ContactKind kind);
  template <ContactKind kind>
  void describe_touching();
  template <ContactKind kind>
  void record_near(int undecided_hits);
  template <ContactKind kind>
  void describe_kept();

  const LeafKernels* kernels_ = nullptr;
  const Mesh* mesh_ = nullptr;
  ContactKey key_{};
  LeafScene scene_{};
  const VerletList* list_ = nullptr;  // null: no list is built in this step
  ListedPairs* listed_ = nullptr;
  const ExcludedPairs* excluded_ = nullptr;
  const std::atomic<bool>* interrupted_ = nullptr;  // null: the end of the step is known
  std::vector<Survivor> survivors_ = std::vector<Survivor>(CandidateQueue::capacity);
  // Only with a separation.
  std::vector<Approach> touching_[2];  // by ContactKind: pairs whose description is deferred
  std::vector<Candidate> movable_ = std::vector<Candidate>(CandidateQueue::capacity);
  NearSplit split_;
  std::vector<ContactPlace> places_ = std::vector<ContactPlace>(CandidateQueue::capacity);
  Stopwatch watch_;
};

}  // namespace lazyccd
