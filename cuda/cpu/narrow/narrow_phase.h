// From candidates to contacts, as one worker does it: filter, decision, description.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/contact_key.h"
#include "core/contact_math.h"
#include "cpu/narrow/leaf_kernels.h"
#include "cpu/scene/mesh.h"
#include "cpu/verlet/verlet_list.h"
#include "cpu/culling/orphan_sets.h"
#include "cpu/stopwatch.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"

namespace lazyccd {

// What comes within the separation, as one worker found it.
struct NearPairs {
  std::vector<Candidate> of[2];  // by ContactKind
  // Where the step begins, all are certainly this far apart.
  double apart = std::numeric_limits<double>::infinity();

  void clear() {
    for (std::vector<Candidate>& pairs : of) pairs.clear();
    apart = std::numeric_limits<double>::infinity();
  }
  std::size_t bytes() const { return (of[0].capacity() + of[1].capacity()) * sizeof(Candidate); }
};

// Its sink's queues lead into it.
class NarrowPhase : public CandidateSink {
 public:
  NarrowPhase() { drain = &drain_full; }

  // For a step; all must outlive it. What is near is listed in
  // a part of `list`, unless that is null.
  void begin(const LeafKernels& kernels, const Mesh& mesh, const LeafScene& scene,
             const VerletList* list, ListedPairs* listed);
  // Of that step only the start is known: what is not near there is put off, and so is the
  // description of what may touch there; all that comes once it is interrupted is left over.
  void begin_at_start(const std::atomic<bool>& interrupted) { interrupted_ = &interrupted; }
  // The same step goes on with all of it known, from what was left over; then from what was put
  // off, which is listed already.
  void resume(const LeafScene& scene);
  void resume_deferred() { list_ = nullptr; }
  // These candidates are tested elsewhere; null: none.
  void drop(const OrphanSets* dropped) { dropped_ = dropped; }

  void push(ContactKind kind, Candidate pair);
  // Of this or another worker's queue, at most CandidateQueue::capacity; changes them.
  void process_queued(ContactKind kind, Candidate* items, int count);
  // Of the listed candidates, at most CandidateQueue::capacity, those that can be near in this
  // step.
  void process_listed(const ListedPairs& part, ContactKind kind, const ListedCandidate* items,
                      int count);
  // Of contacts of one kind that are near, sorted: appends those that are to be reported.
  void reduce(Span<const Contact> near, std::vector<Contact>& kept);

  // They are kept elsewhere; their number still counts.
  void forget_contacts() {
    contacts.clear();
    keys.clear();
  }

  const LeafScene& scene() const { return scene_; }

  // Of this step:
  std::vector<Contact> contacts;
  std::vector<std::uint64_t> keys;                                   // of these, for their order
  std::int64_t candidates[2] = {}, survived[2] = {}, found[2] = {};  // by ContactKind
  std::int64_t filtered_noncoplanar = 0, double_precision_tests = 0, exact = 0;
  std::int64_t from_list = 0;  // of the candidates
  double ms = 0;
  std::vector<Candidate> deferred[2], pending[2];  // by ContactKind
  // Of the last step with a separation.
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
  int copy_free(const Candidate* items, int count);
  void list_near(ContactKind kind);
  void put_off_open(ContactKind kind);
  void put_off_touching(ContactKind kind);
  template <ContactKind kind>
  void describe_touching();
  void note_near(ContactKind kind, int left);
  template <ContactKind kind>
  bool is_out_of_reach(const Approach& approach) const;
  template <ContactKind kind>
  void describe_own();

  const LeafKernels* kernels_ = nullptr;
  const Mesh* mesh_ = nullptr;
  ContactKey key_{};
  LeafScene scene_{};
  const VerletList* list_ = nullptr;  // null: nothing is listed
  ListedPairs* listed_ = nullptr;
  const OrphanSets* dropped_ = nullptr;
  const std::atomic<bool>* interrupted_ = nullptr;  // null: all of the step is known
  std::vector<Survivor> survivors_ = std::vector<Survivor>(CandidateQueue::capacity);
  // With a separation:
  std::vector<Approach> touching_[2];  // by ContactKind: to be described
  std::vector<Candidate> free_ = std::vector<Candidate>(CandidateQueue::capacity);
  NearSplit split_;
  std::vector<Place> places_ = std::vector<Place>(CandidateQueue::capacity);
  Stopwatch watch_;
};

}  // namespace lazyccd
