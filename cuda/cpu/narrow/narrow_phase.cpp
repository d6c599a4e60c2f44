#include "cpu/narrow/narrow_phase.h"

#include <algorithm>
#include <cstddef>

#include "core/separation.h"
#include "cpu/narrow/exact.h"

namespace lazyccd {
namespace {

bool at_start(const Approach& approach) { return approach_tick(approach.t) == 0; }

// Of vertices: the largest of each of two primitives, of which the first has `split`, and of these
// the smaller one.
double reach_of(const std::array<std::int32_t, 4>& vertices, int split,
                const std::vector<float>& reach) {
  const auto largest = [&](int first, int last) {
    float most = 0;
    for (int i = first; i < last; ++i) most = std::max(most, reach[vertices[i]]);
    return static_cast<double>(most);
  };
  return std::min(largest(0, split), largest(split, 4));
}

}  // namespace

void NarrowPhase::begin(const LeafKernels& kernels, const Mesh& mesh, const LeafScene& scene,
                        const VerletList* list, ListedPairs* listed) {
  kernels_ = &kernels;
  mesh_ = &mesh;
  scene_ = scene;
  list_ = list;
  listed_ = listed;
  dropped_ = nullptr;
  interrupted_ = nullptr;
  key_ = mesh.contact_key();
  contacts.clear();
  keys.clear();
  filtered_noncoplanar = double_precision_tests = exact = 0;
  from_list = 0;
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

// Keeps what would leave lanes of the last pack empty.
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
  if (dropped_) {
    const auto orphan = [&](Candidate c) { return dropped_->of(kind).contains(kind, c); };
    count = static_cast<int>(std::remove_if(items, items + count, orphan) - items);
  }
  process(kind, items, count);
}

// At most CandidateQueue::capacity.
void NarrowPhase::process(ContactKind kind, const Candidate* items, int count) {
  if (count == 0) return;
  // Relaxed: who comes too late to see it does a little more.
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
  if (scene_.separation > 0) {
    report_near<kind>(items, count);
    return;
  }
  int left = count;
  if (scene_.single_first) {
    left = kernels_->filter(scene_, kind, items, count, survivors_.data());
  } else {
    for (int i = 0; i < count; ++i) survivors_[i] = {items[i], 0, 0, false};
  }
  survived[static_cast<int>(kind)] += left;
  for (int i = 0; i < left; ++i) report_touching<kind>(survivors_[i]);
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

// A contact that is complete.
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
    ++exact;
    decision = decide_exactly(kind, q);
  }
  return decision;
}

template <ContactKind kind>
void NarrowPhase::report_near(const Candidate* items, int count) {
  if (mesh_->any_pinned()) {
    count = copy_free<kind>(items, count);
    items = free_.data();
  }
  kernels_->near_at_start(scene_, kind, items, count, split_);
  if (list_) list_near(kind);
  if (interrupted_) put_off_open(kind);
  Approach* const open = split_.open;
  survived[static_cast<int>(kind)] += split_.near_count + split_.open_count;
  const int left = kernels_->within(scene_, kind, open, split_.open_count);
  note_near(kind, left);
  for (int i = 0; i < left; ++i)
    if (!open[i].is_redundant || !at_start(open[i])) split_.own[split_.own_count++] = open[i];
  const auto last =
      std::remove_if(split_.own, split_.own + split_.own_count,
                     [this](const auto& a) { return at_start(a) && is_out_of_reach<kind>(a); });
  split_.own_count = static_cast<int>(last - split_.own);
  if (interrupted_) put_off_touching(kind);
  describe_own<kind>();
}

// Of its own body, where the step begins.
template <ContactKind kind>
bool NarrowPhase::is_out_of_reach(const Approach& approach) const {
  const std::vector<float>& reach = mesh_->self_separation();
  if (reach.empty()) return false;
  Contact pair;
  identify_contact<kind>(scene_.mesh, approach.pair, pair);
  if (pair.body_a != pair.body_b) return false;
  const int split = kind == ContactKind::vertex_face ? 1 : 2;
  return approach.apart > scene_.scale * reach_of(pair.vertices, split, reach);
}

template <ContactKind kind>
int NarrowPhase::copy_free(const Candidate* items, int count) {
  Contact contact;
  int copied = 0;
  for (int i = 0; i < count; ++i) {
    identify_contact<kind>(scene_.mesh, items[i], contact);
    if (!all_pinned(contact)) free_[copied++] = items[i];
  }
  return copied;
}

void NarrowPhase::list_near(ContactKind kind) {
  const float reach = list_->listing_distance();
  const auto add = [&](Candidate pair, float apart) {
    if (apart <= reach) listed_->add(kind, pair, apart, list_->groups());
  };
  for (int i = 0; i < split_.near_count; ++i) add(split_.near[i], 0);
  for (int i = 0; i < split_.open_count; ++i) add(split_.open[i].pair, split_.open[i].apart);
  for (int i = 0; i < split_.away_count; ++i) add(split_.away[i], split_.away_apart[i]);
}

// They are counted where they are tested.
void NarrowPhase::put_off_open(ContactKind kind) {
  std::vector<Candidate>& pairs = deferred[static_cast<int>(kind)];
  for (int i = 0; i < split_.open_count; ++i) pairs.push_back(split_.open[i].pair);
  candidates[static_cast<int>(kind)] -= split_.open_count;
  split_.open_count = 0;
}

// Where there is no gap, a normal faces the way that the step goes.
void NarrowPhase::put_off_touching(ContactKind kind) {
  int apart = 0;
  for (int i = 0; i < split_.own_count; ++i) {
    if (split_.own[i].apart > 0) {
      split_.own[apart++] = split_.own[i];
    } else {
      touching_[static_cast<int>(kind)].push_back(split_.own[i]);
    }
  }
  split_.own_count = apart;
}

template <ContactKind kind>
void NarrowPhase::describe_touching() {
  const std::vector<Approach>& all = touching_[static_cast<int>(kind)];
  constexpr std::size_t most = CandidateQueue::capacity;
  for (std::size_t first = 0; first < all.size(); first += most) {
    split_.own_count = static_cast<int>(std::min(most, all.size() - first));
    std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(first), split_.own_count, split_.own);
    describe_own<kind>();
  }
}

// Those that can be near in this step.
void NarrowPhase::process_listed(const ListedPairs& part, ContactKind kind,
                                 const ListedCandidate* items, int count) {
  Candidate within_reach[CandidateQueue::capacity];
  int left = 0;
  for (int i = 0; i < count; ++i) {
    within_reach[left] = items[i].pair;
    left += items[i].apart <= part.distance_limit[items[i].groups];
  }
  from_list += left;
  process(kind, within_reach, left);
}

// What the split says is near, and the first `left` of what was open.
void NarrowPhase::note_near(ContactKind kind, int left) {
  std::vector<Candidate>& pairs = near_pairs.of[static_cast<int>(kind)];
  pairs.insert(pairs.end(), split_.near, split_.near + split_.near_count);
  float apart = split_.apart;
  for (int i = 0; i < left; ++i) {
    pairs.push_back(split_.open[i].pair);
    apart = std::min(apart, split_.open[i].apart);
  }
  near_pairs.apart = std::min(near_pairs.apart, apart / scene_.scale);
}

template <ContactKind kind>
void NarrowPhase::describe_own() {
  kernels_->describe(scene_, kind, split_.own, split_.own_count, places_.data());
  for (int i = 0; i < split_.own_count; ++i) {
    // In its place: a copy would wait for what has just been written.
    Contact& contact = contacts.emplace_back();
    identify_contact<kind>(scene_.mesh, split_.own[i].pair, contact);
    contact.toi = static_cast<double>(approach_tick(split_.own[i].t)) * kTick;
    contact.u = places_[i].u;
    contact.v = places_[i].v;
    contact.normal = places_[i].normal;
    count(contact);
  }
}

// Of contacts of one kind that are near, sorted: appends those that are to be reported.
void NarrowPhase::reduce(Span<const Contact> near, std::vector<Contact>& kept) {
  const ContactKind kind = near[0].kind;
  for (std::size_t i = 0; i < near.size(); ++i)
    free_[i] = {near[i].primitive_a, near[i].primitive_b};
  const int count = static_cast<int>(near.size());
  kernels_->near_at_start(scene_, kind, free_.data(), count, split_);
  note_near(kind, split_.open_count);
  const auto is_left_out = [&](const Approach& approach) {
    return approach.is_redundant ||
           (kind == ContactKind::vertex_face ? is_out_of_reach<ContactKind::vertex_face>(approach)
                                             : is_out_of_reach<ContactKind::edge_edge>(approach));
  };
  int own = 0, open = 0;
  for (const Contact& contact : near) {
    const Candidate pair = {contact.primitive_a, contact.primitive_b};
    const Approach* approach = nullptr;
    if (own < split_.own_count && split_.own[own].pair == pair) {
      approach = &split_.own[own++];
    } else if (open < split_.open_count && split_.open[open].pair == pair) {
      approach = &split_.open[open++];
    }
    if (approach && !(contact.toi == 0 && is_left_out(*approach))) kept.push_back(contact);
  }
}

std::size_t NarrowPhase::bytes() const {
  return survivors_.capacity() * sizeof(Survivor) + free_.capacity() * sizeof(Candidate) +
         places_.capacity() * sizeof(Place) + near_pairs.bytes() +
         contacts.capacity() * sizeof(Contact) + keys.capacity() * sizeof(std::uint64_t) +
         (deferred[0].capacity() + deferred[1].capacity() + pending[0].capacity() +
          pending[1].capacity()) *
             sizeof(Candidate) +
         (touching_[0].capacity() + touching_[1].capacity()) * sizeof(Approach);
}

}  // namespace lazyccd
