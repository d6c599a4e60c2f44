#include "cpu/narrow/narrow_phase.h"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "core/narrow/separation.h"
#include "cpu/narrow/exact.h"

namespace lazyccd {
namespace {

bool at_start(const Approach& approach) { return approach_tick(approach.t) == 0; }

}  // namespace

void NarrowPhase::begin(const LeafKernels& kernels, const Mesh& mesh, const LeafScene& scene,
                        const VerletList* list, ListedPairs* listed) {
  kernels_ = &kernels;
  mesh_ = &mesh;
  scene_ = scene;
  list_ = list;
  listed_ = listed;
  excluded_ = nullptr;
  interrupted_ = nullptr;
  key_ = mesh.contact_key();
  contacts.clear();
  keys.clear();
  filtered_noncoplanar = double_precision_tests = exact_tests = listed_candidates = 0;
  ms = 0;
  for (int kind = 0; kind < 2; ++kind) {
    queues[kind].count = candidates[kind] = survived[kind] = found[kind] = 0;
    deferred[kind].clear();
    pending[kind].clear();
    touching_[kind].clear();
  }
}

void NarrowPhase::resume(const LeafScene& scene) {
  scene_ = scene;
  interrupted_ = nullptr;
  ms = 0;
  describe_touching<ContactKind::vertex_face>();
  describe_touching<ContactKind::edge_edge>();
}

// Processes whole packs of lanes only. The rest stays in the queue.
void NarrowPhase::drain_full(CandidateSink& self, ContactKind kind) {
  CandidateQueue& queue = self.queues[static_cast<int>(kind)];
  const int whole = queue.count / kBlockLanes * kBlockLanes;
  static_cast<NarrowPhase&>(self).process_queued(kind, queue.items, whole);
  queue.count -= whole;
  std::copy_n(queue.items + whole, queue.count, queue.items);
}

void NarrowPhase::push(ContactKind kind, Candidate pair) {
  CandidateQueue& queue = queues[static_cast<int>(kind)];
  if (queue.count == CandidateQueue::capacity) drain_full(*this, kind);
  queue.items[queue.count++] = pair;
}

void NarrowPhase::process_queued(ContactKind kind, Candidate* items, int count) {
  if (excluded_) count = excluded_->remove_from(kind, items, count);
  process(kind, items, count);
}

// Processes at most CandidateQueue::capacity candidates, or postpones them after an interruption.
void NarrowPhase::process(ContactKind kind, const Candidate* items, int count) {
  if (count == 0) return;
  // Relaxed: a thread that sees the flag late only does a little more work.
  if (interrupted_ && interrupted_->load(std::memory_order_relaxed)) {
    std::vector<Candidate>& rest = pending[static_cast<int>(kind)];
    rest.insert(rest.end(), items, items + count);
    return;
  }
  candidates[static_cast<int>(kind)] += count;
  watch_.lap();
  if (kind == ContactKind::vertex_face) {
    process_kind<ContactKind::vertex_face>(items, count);
  } else {
    process_kind<ContactKind::edge_edge>(items, count);
  }
  ms += watch_.lap();
}

template <ContactKind kind>
void NarrowPhase::process_kind(const Candidate* items, int count) {
  if (scene_.separation.between_bodies > 0) {
    report_near<kind>(items, count);
    return;
  }
  int survivors = count;
  if (scene_.single_first) {
    survivors = kernels_->filter(scene_, kind, items, count, survivors_.data());
  } else {
    for (int i = 0; i < count; ++i) survivors_[i] = {items[i], 0, 0, false};
  }
  survived[static_cast<int>(kind)] += survivors;
  for (int i = 0; i < survivors; ++i) report_touching<kind>(survivors_[i]);
}

bool NarrowPhase::all_pinned(const Contact& contact) const {
  return mesh_->any_pinned() && std::all_of(contact.vertices.begin(), contact.vertices.end(),
                                            [&](std::int32_t v) { return mesh_->pinned(v); });
}

QueryCoordinates NarrowPhase::coordinates(const Contact& contact) const {
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    const double* x = scene_.records + 8 * std::ptrdiff_t{contact.vertices[i]};
    q.start[i] = {x[0], x[1], x[2]};
    q.end[i] = {x[3], x[4], x[5]};
  }
  return q;
}

// Counts a complete contact and stores its sort key.
void NarrowPhase::count(const Contact& contact) {
  keys.push_back(key_(contact));
  ++found[static_cast<int>(contact.kind)];
}

template <ContactKind kind>
void NarrowPhase::report_touching(const Survivor& survivor) {
  Contact contact;
  identify_contact<kind>(scene_.mesh, survivor.pair, contact);
  if (all_pinned(contact)) return;
  const QueryCoordinates q = coordinates(contact);
  const Decision decision = decide<kind>(survivor, q);
  if (decision.kind != Decision::hit) return;
  contact.toi = static_cast<double>(decision.tick) * kTick;
  describe_contact<kind>(q, contact.toi, false, contact);
  contacts.push_back(contact);
  count(contact);
}

template <ContactKind kind>
Decision NarrowPhase::decide(const Survivor& survivor, const QueryCoordinates& q) {
  const Differences<double> d = differences<kind>(q, scene_.scale);
  Decision decision;
  if (survivor.hit) {
    decision = timed_hit(coplanarity(d, magnitudes(d)), survivor.lo, survivor.hi);
  } else {
    ++double_precision_tests;
    decision = decide_in_double<kind>(d);
  }
  if (decision.kind == Decision::undecided) {
    ++exact_tests;
    decision = decide_exactly(kind, q);
  }
  return decision;
}

template <ContactKind kind>
void NarrowPhase::report_near(const Candidate* items, int count) {
  if (mesh_->any_pinned()) {
    count = copy_movable<kind>(items, count);
    items = movable_.data();
  }
  kernels_->near_at_start(scene_, kind, items, count, split_);
  if (list_) {
    list_near<kind>();
    if (mesh_->any_resting()) drop_resting<kind>();
  }
  if (interrupted_) defer_undecided(kind);
  Approach* const undecided = split_.undecided;
  survived[static_cast<int>(kind)] += split_.near_count + split_.undecided_count;
  const int hits = kernels_->within(scene_, kind, undecided, split_.undecided_count);
  record_near<kind>(hits);
  for (int i = 0; i < hits; ++i)
    if (!undecided[i].is_redundant || !at_start(undecided[i]))
      split_.kept[split_.kept_count++] = undecided[i];
  if (interrupted_) defer_touching(kind);
  describe_kept<kind>();
}

template <ContactKind kind>
int NarrowPhase::copy_movable(const Candidate* items, int count) {
  Contact contact;
  int copied = 0;
  for (int i = 0; i < count; ++i) {
    identify_contact<kind>(scene_.mesh, items[i], contact);
    if (!all_pinned(contact)) movable_[copied++] = items[i];
  }
  return copied;
}

// The list is made for the separation between bodies. A pair with a smaller one is listed as if it
// were farther apart by the difference.
template <ContactKind kind>
void NarrowPhase::list_near() {
  const float limit = list_->listing_distance();
  const Separations& separation = scene_.separation;
  const auto add = [&](Candidate pair, float min_distance) {
    min_distance += separation.saving(separation.of<kind>(scene_.mesh, pair), scene_.scale);
    if (min_distance <= limit) listed_->add(kind, pair, min_distance, *list_);
  };
  for (int i = 0; i < split_.near_count; ++i) add(split_.near[i], 0);
  for (int i = 0; i < split_.undecided_count; ++i)
    add(split_.undecided[i].pair, split_.undecided[i].min_distance);
  for (int i = 0; i < split_.far_count; ++i) add(split_.far[i], split_.far_min_distance[i]);
}

// Drops the pairs of resting bodies, which only the Verlet list needs.
template <ContactKind kind>
void NarrowPhase::drop_resting() {
  const auto rest = [this](Candidate pair) {
    Contact contact;
    identify_contact<kind>(scene_.mesh, pair, contact);
    return mesh_->rests(contact.body_a) && mesh_->rests(contact.body_b);
  };
  int near_count = 0;
  for (int i = 0; i < split_.near_count; ++i) {
    split_.near[near_count] = split_.near[i];
    split_.near_min_distance[near_count] = split_.near_min_distance[i];
    near_count += !rest(split_.near[i]);
  }
  split_.near_count = near_count;
  const auto drop = [&](Approach* approaches, int& count) {
    const auto last = std::remove_if(approaches, approaches + count,
                                     [&](const Approach& a) { return rest(a.pair); });
    count = static_cast<int>(last - approaches);
  };
  drop(split_.kept, split_.kept_count);
  drop(split_.undecided, split_.undecided_count);
}

// Defers the undecided candidates until the end of the step is known. They count as candidates when
// they are tested.
void NarrowPhase::defer_undecided(ContactKind kind) {
  std::vector<Candidate>& pairs = deferred[static_cast<int>(kind)];
  for (int i = 0; i < split_.undecided_count; ++i) pairs.push_back(split_.undecided[i].pair);
  candidates[static_cast<int>(kind)] -= split_.undecided_count;
  split_.undecided_count = 0;
}

// Defers the description of pairs that may touch at the start. Without a gap the sign of the normal
// depends on the motion, so on the end of the step.
void NarrowPhase::defer_touching(ContactKind kind) {
  int separated = 0;
  for (int i = 0; i < split_.kept_count; ++i) {
    if (split_.kept[i].min_distance > 0) {
      split_.kept[separated++] = split_.kept[i];
    } else {
      touching_[static_cast<int>(kind)].push_back(split_.kept[i]);
    }
  }
  split_.kept_count = separated;
}

template <ContactKind kind>
void NarrowPhase::describe_touching() {
  const std::vector<Approach>& all = touching_[static_cast<int>(kind)];
  constexpr std::size_t batch = CandidateQueue::capacity;
  for (std::size_t first = 0; first < all.size(); first += batch) {
    split_.kept_count = static_cast<int>(std::min(batch, all.size() - first));
    std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(first), split_.kept_count, split_.kept);
    describe_kept<kind>();
  }
}

// Keeps the candidates whose distance, when the list was built, was small enough for this step.
void NarrowPhase::process_listed(const ListedPairs& part, ContactKind kind,
                                 const ListedCandidate* items, int count) {
  Candidate selected[CandidateQueue::capacity];
  int selected_count = 0;
  for (int i = 0; i < count; ++i) {
    selected[selected_count] = items[i].pair;
    selected_count += items[i].min_distance <= part.distance_limit[items[i].groups];
  }
  listed_candidates += selected_count;
  process(kind, selected, selected_count);
}

// Records split_.near and the first `undecided_hits` of split_.undecided as within the separation.
template <ContactKind kind>
void NarrowPhase::record_near(int undecided_hits) {
  if (split_.near_count + undecided_hits == 0) return;
  std::vector<double>& min_distance = near_pairs.min_distance;
  if (min_distance.empty())
    min_distance.assign(mesh_->body_count(), std::numeric_limits<double>::infinity());
  std::vector<Candidate>& pairs = near_pairs.of[static_cast<int>(kind)];
  const auto record = [&](Candidate pair, float scaled_distance) {
    pairs.push_back(pair);
    Contact contact;
    identify_contact<kind>(scene_.mesh, pair, contact);
    const double distance = scaled_distance / scene_.scale;
    for (const std::int32_t body : {contact.body_a, contact.body_b})
      min_distance[body] = std::min(min_distance[body], distance);
  };
  for (int i = 0; i < split_.near_count; ++i) record(split_.near[i], split_.near_min_distance[i]);
  for (int i = 0; i < undecided_hits; ++i)
    record(split_.undecided[i].pair, split_.undecided[i].min_distance);
}

template <ContactKind kind>
void NarrowPhase::describe_kept() {
  kernels_->describe(scene_, kind, split_.kept, split_.kept_count, places_.data());
  for (int i = 0; i < split_.kept_count; ++i) {
    // Constructed in place: a copy would have to wait for the stores of the fields just written.
    Contact& contact = contacts.emplace_back();
    identify_contact<kind>(scene_.mesh, split_.kept[i].pair, contact);
    contact.toi = static_cast<double>(approach_tick(split_.kept[i].t)) * kTick;
    contact.u = places_[i].u;
    contact.v = places_[i].v;
    contact.normal = places_[i].normal;
    count(contact);
  }
}

std::size_t NarrowPhase::bytes() const {
  return survivors_.capacity() * sizeof(Survivor) + movable_.capacity() * sizeof(Candidate) +
         places_.capacity() * sizeof(ContactPlace) + near_pairs.bytes() +
         contacts.capacity() * sizeof(Contact) + keys.capacity() * sizeof(std::uint64_t) +
         (deferred[0].capacity() + deferred[1].capacity() + pending[0].capacity() +
          pending[1].capacity()) *
             sizeof(Candidate) +
         (touching_[0].capacity() + touching_[1].capacity()) * sizeof(Approach);
}

}  // namespace lazyccd
