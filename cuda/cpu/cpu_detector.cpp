#include "cpu/cpu_detector.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>

#include "core/contact_math.h"
#include "core/separation.h"
#include "cpu/detector_worker.h"
#include "cpu/narrow/candidate_batches.h"
#include "cpu/scene/positions.h"
#include "cpu/scene/scale.h"
#include "cpu/stopwatch.h"
#include "cpu/threads/thread_pool.h"
#include "lazyccd/error.h"

namespace lazyccd {
namespace {

// Returns whether the first `split` of four vertices are on one side of the others along an axis,
// at both ends of the step and so during the whole step.
bool apart(const std::vector<VertexRecord>& records, const std::array<std::int32_t, 4>& vertices,
           int split) {
  for (int k = 0; k < 3; ++k) {
    bool below = true, above = true;
    for (int end = 0; end < 2; ++end) {
      for (int i = 0; i < split; ++i) {
        for (int j = split; j < 4; ++j) {
          const double a = records[vertices[i]].x[3 * end + k],
                       b = records[vertices[j]].x[3 * end + k];
          below = below && a < b;
          above = above && a > b;
        }
      }
    }
    if (below || above) return true;
  }
  return false;
}

bool is_vertex_face(const Contact& contact) { return contact.kind == ContactKind::vertex_face; }

}  // namespace

CpuDetector::CpuDetector(const DetectorOptions& options, const Threads& threads,
                         const LeafKernels& kernels)
    : options_(options),
      kernels_(&kernels),
      threads_(threads),
      pool_(threads_.pool()),
      traversal_(pool_, options.algorithm.strategy, options.algorithm.tuning),
      groups_(separation_margin(options.separation), kernels),
      volume_(make_node_volume(options.algorithm.volume, separation_margin(options.separation))),
      front_policy_(options.algorithm.front_period, options.algorithm.front_ratio),
      verlet_list_(options.separation, pool_.size()) {
  // Reduction keeps a vertex-face pair in place of others. Without vertex-face tests it would be
  // missing.
  options_.reduce_contacts = options.reduce_contacts && options.vertex_face;
  // These two rule out pairs that cannot touch. Such pairs can still come within the separation.
  if (options.separation > 0)
    options_.algorithm.culling.normal_cones = options_.algorithm.culling.orphan_sets = false;
  for (int i = 0; i < pool_.size(); ++i) workers_.push_back(std::make_unique<Worker>());
}

CpuDetector::~CpuDetector() { discard_ahead(); }

void CpuDetector::set_mesh(const Mesh& mesh) {
  discard_ahead();
  near_pairs_lost_ = false;
  mesh_ = &mesh;
  built_ = false;
  front_policy_.forget();
  verlet_list_.forget();
  sort_ = std::make_unique<ContactSort>(mesh);
  for (const auto& worker : workers_) worker->near_pairs.clear();
  if (options_.algorithm.culling.orphan_sets) orphans_ = OrphanSets(mesh);
}

void CpuDetector::update_hierarchy(Stats& stats) {
  bool build = !built_ || options_.algorithm.rebuild_every_step;
  const bool builds_list =
      may_list() && !verlet_list_.is_built() && verlet_list_.is_worthwhile(scale_);
  list_state_ = builds_list ? ListState::building : ListState::off;
  groups_.set_margin(separation_margin(options_.separation) +
                     (builds_list ? verlet_list_.skin() : 0) +
                     tolerance_ * (1 + 0x1p-20));
  if (!build) {
    groups_.refit(records_, pool_, scale_);
    tree_.refit(groups_.boxes());
    build = tree_.cost() > options_.algorithm.rebuild_ratio * built_cost_;
  }
  if (build) {
    groups_.build(*mesh_, records_, pool_, scale_);
    tree_.build(groups_.boxes());
    built_cost_ = tree_.cost();
    built_ = true;
    find_node_info();
    front_policy_.forget();
    if (may_list()) verlet_list_.build(*mesh_, groups_, tree_);
    if (options_.algorithm.culling.normal_cones) cones_.build(*mesh_, groups_, tree_);
  }
  if (volume_) volume_->refit(groups_, tree_, records_, pool_);
  if (options_.algorithm.culling.normal_cones) cones_.refit(*mesh_, tree_, records_, pool_);
  stats.rebuilt = build;
}

// Whether Verlet lists are possible. Other volumes than boxes have no margin for the skin.
bool CpuDetector::may_list() const {
  return options_.separation > 0 && !volume_ && !options_.algorithm.rebuild_every_step;
}

void CpuDetector::find_node_info() {
  const std::vector<TreeNode>& nodes = tree_.nodes();
  node_info_.resize(nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {
    if (nodes[i].leaf()) {
      const Group& group = groups_.groups()[nodes[i].group()];
      node_info_[i] = {group.body, group.pinned != 0};
    } else {
      const NodeInfo &left = node_info_[nodes[i].left], &right = node_info_[nodes[i].right];
      node_info_[i] = {left.body == right.body ? left.body : -1, left.pinned && right.pinned};
    }
  }
}

// Whether the collision filters and pins allow contacts between two nodes, at any positions.
bool CpuDetector::may_collide(NodePair pair) const {
  const NodeInfo &a = node_info_[pair.a], &b = node_info_[pair.b];
  return !(a.pinned && b.pinned) && (a.body < 0 || b.body < 0 || mesh_->collide(a.body, b.body));
}

void CpuDetector::visit_pair(Worker& worker, NodePair pair) {
  const std::int32_t a = tree_.nodes()[pair.a].group(), b = tree_.nodes()[pair.b].group();
  if (!kernels_->visit(worker.scene(), a, b, worker)) return;
  ++worker.group_pairs;
  if (list_state_ == ListState::probing) worker.lasting += verlet_list_.would_stay_valid(pair);
}

LeafScene CpuDetector::leaf_scene(double separation, Worker& worker) const {
  const float scaled = static_cast<float>(separation * scale_);
  // Two points may come nearer to each other by twice the tolerance.
  const float unknown = static_cast<float>(2 * tolerance_ * scale_);
  return {groups_.groups().data(),
          groups_.boxes().data(),
          groups_.blocks().data(),
          records_.empty() ? nullptr : records_.data()->x,
          mesh_->view(),
          scale_,
          options_.vertex_face,
          options_.edge_edge,
          separation,
          scaled * (1 - 0x1p-18f),
          (scaled + unknown) * (1 + 0x1p-10f),
          options_.algorithm.arithmetic == Arithmetic::single_first,
          options_.algorithm.culling.non_penetration ? &worker.filtered_noncoplanar : nullptr,
          options_.reduce_contacts ? mesh_->first_faces() : FirstFaces{}};
}

void CpuDetector::begin_workers(double separation) {
  for (int i = 0; i < pool_.size(); ++i) {
    Worker& worker = *workers_[static_cast<std::size_t>(i)];
    worker.begin(*kernels_, *mesh_, leaf_scene(separation, worker),
                 list_state_ == ListState::building ? &verlet_list_ : nullptr,
                 &verlet_list_.part(i));
    worker.begin_traversal();
  }
}

void CpuDetector::traverse(Stats& stats) {
  if (options_.algorithm.culling.orphan_sets) {
    for (const auto& worker : workers_) worker->exclude(&orphans_);
  }
  if (tree_.nodes().empty()) return;
  if (options_.algorithm.strategy == Strategy::thread_per_query) {
    query_each_group(stats);
  } else {
    const NodePair root{0, 0};
    stats.front_reused = options_.algorithm.front == FrontUse::on && front_policy_.reuse();
    if (stats.front_reused) {
      balanced_traversal(front_, stats);
    } else {
      balanced_traversal({&root, 1}, stats);
    }
  }
  test_pending(list_state_ == ListState::in_use);
  if (options_.algorithm.culling.orphan_sets) test_orphans(stats);
}

void CpuDetector::record_list_probe() {
  std::int64_t pairs = 0, lasting = 0;
  for (const auto& worker : workers_) {
    pairs += worker->group_pairs;
    lasting += worker->lasting;
  }
  verlet_list_.record_probe(pairs, lasting);
}

// Tests the candidates that are left in the workers' queues and the pending ones. With `listed`,
// tests the candidates of the Verlet list too.
void CpuDetector::test_pending(bool listed) {
  constexpr ContactKind kinds[] = {ContactKind::vertex_face, ContactKind::edge_edge};
  std::size_t rest = 0;
  for (const auto& worker : workers_) {
    for (const CandidateQueue& queue : worker->queues)
      rest += static_cast<std::size_t>(queue.count);
    for (const std::vector<Candidate>& pairs : worker->pending) rest += pairs.size();
  }
  if (listed) {
    verlet_list_.measure_distances();
    rest += verlet_list_.size();
  }
  CandidateBatches batches(rest, pool_.available());
  for (const ContactKind kind : kinds) {
    for (const auto& worker : workers_) {
      CandidateQueue& queue = worker->queues[static_cast<int>(kind)];
      batches.add(kind, queue.items, static_cast<std::size_t>(queue.count));
      queue.count = 0;
      if (!is_running_ahead_) batches.add(kind, worker->pending[static_cast<int>(kind)]);
    }
    if (!listed) continue;
    for (const ListedPairs& part : verlet_list_.parts()) batches.add(kind, part);
  }
  test(batches);
}

void CpuDetector::test(const CandidateBatches& batches) {
  pool_.parallel_for(
      batches.size(), batches.grain(), [&](std::size_t first, std::size_t last, int id) {
        for (std::size_t i = first; i < last; ++i) {
          const CandidateBatch& batch = batches[i];
          const int count = static_cast<int>(batch.count);
          if (batch.listed) {
            workers_[id]->process_listed(*batch.part, batch.kind, batch.listed, count);
          } else {
            workers_[id]->process_queued(batch.kind, batch.queued, count);
          }
        }
      });
}

// Traverses the tree from the initial pairs (da Silva, Algorithm 2.1): a pair of overlapping nodes
// is replaced by pairs of children, down to pairs of leaves.
void CpuDetector::balanced_traversal(Span<const NodePair> initial, Stats& stats) {
  const TreeNode* nodes = tree_.nodes().data();
  const bool keep = options_.algorithm.front == FrontUse::on,
             cones = options_.algorithm.culling.normal_cones;
  const NodeVolume* volume = volume_.get();
  stats.front_start = static_cast<std::int64_t>(initial.size());
  Stopwatch watch;
  const RunCounts counts =
      traversal_.run(initial.data(), initial.size(), [&](int id, NodePair pair, auto& emit) {
        Worker& worker = *workers_[id];
        // Relaxed: a worker that sees the flag late only visits a few more pairs.
        if (is_interrupted_.load(std::memory_order_relaxed))
          return worker.unexpanded.push_back(pair);
        if (cones && pair.a == pair.b && cones_.apart_from_itself(pair.a, records_)) {
          ++worker.flat;
          ++worker.ended;
          if (keep) worker.front.push_back(pair);
          return;
        }
        PairVisit v = visit(pair, nodes[pair.a], nodes[pair.b]);
        if (v.near && (!may_collide(pair) || is_listed(pair))) v = {false, 0, {}};
        if (volume && v.near && pair.a != pair.b && volume->apart(pair.a, pair.b)) {
          ++worker.culled;
          v = {false, 0, {}};
        }
        for (int i = 0; i < v.children; ++i) emit(v.child[i]);
        if (v.children != 0) return;
        ++worker.ended;
        if (keep) worker.front.push_back(pair);
        if (v.near) visit_pair(worker, pair);
      });
  stats.tree_tests += static_cast<std::int64_t>(counts.items);
  stats.steals += static_cast<std::int64_t>(counts.steals);
  stats.overflows += static_cast<std::int64_t>(counts.overflows);
  stats.balancings += static_cast<std::int64_t>(counts.rounds);
  count_idle(counts.ms_present - counts.ms_waited, watch.lap(), stats);
  unexpanded_.clear();
  for (const auto& worker : workers_)
    unexpanded_.insert(unexpanded_.end(), worker->unexpanded.begin(), worker->unexpanded.end());
  if (!keep || !unexpanded_.empty()) return;
  keep_front(stats.front_reused);
  stats.ms_front = watch.lap();
}

void CpuDetector::test_orphans(Stats& stats) {
  for (const auto& worker : workers_) worker->exclude(nullptr);
  std::atomic<std::int64_t> near{0};
  const auto test = [&](ContactKind kind, Candidate pair, Worker& worker) {
    Contact c;
    if (kind == ContactKind::vertex_face) {
      identify_contact<ContactKind::vertex_face>(worker.scene().mesh, pair, c);
    } else {
      identify_contact<ContactKind::edge_edge>(worker.scene().mesh, pair, c);
    }
    const int split = kind == ContactKind::vertex_face ? 1 : 2;  // vertices of the first primitive
    if (!mesh_->collide(c.body_a, c.body_b) || apart(records_, c.vertices, split)) return false;
    worker.push(kind, pair);
    return true;
  };
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
    if (!(kind == ContactKind::vertex_face ? options_.vertex_face : options_.edge_edge)) continue;
    const OrphanList orphans = orphans_.of(kind);
    pool_.parallel_for(orphans.count, 1024, [&](std::size_t first, std::size_t last, int id) {
      std::int64_t pushed = 0;
      for (std::size_t i = first; i < last; ++i)
        pushed += test(kind, orphans.pairs[i], *workers_[id]);
      near.fetch_add(pushed, std::memory_order_relaxed);  // read after the end of the job
    });
  }
  test_pending(false);
  stats.orphan_tests = near.load(std::memory_order_relaxed);
}

// Computes the idle share from the wall time of a traversal and the sum of the times that the
// workers were busy. Both are in milliseconds.
void CpuDetector::count_idle(double busy, double wall, Stats& stats) const {
  if (wall <= 0) return;
  stats.idle_share = std::max(0.0, 1 - busy / (wall * pool_.available()));
  stats.ms_balance = stats.idle_share * wall;
}

void CpuDetector::query_each_group(Stats& stats) {
  const std::vector<TreeNode>& nodes = tree_.nodes();
  Stopwatch watch;
  std::atomic<std::int64_t> tests{0};
  pool_.parallel_for(nodes.size(), 64, [&](std::size_t first, std::size_t last, int id) {
    Worker& worker = *workers_[id];
    Stopwatch busy;
    std::vector<std::uint32_t> stack;
    std::int64_t tested = 0;
    for (std::size_t query = first; query < last; ++query) {
      const TreeNode& q = nodes[query];
      if (!q.leaf()) continue;
      const auto self = static_cast<std::uint32_t>(query);
      if (may_collide({self, self}) && !is_listed({self, self})) visit_pair(worker, {self, self});
      stack.push_back(0);
      while (!stack.empty()) {
        const std::uint32_t other = stack.back();
        stack.pop_back();
        const TreeNode& n = nodes[other];
        ++tested;
        if (!overlap(q, n)) continue;
        if (volume_ && self != other && volume_->apart(self, other)) {
          ++worker.culled;
          continue;
        }
        if (!n.leaf()) {
          stack.push_back(static_cast<std::uint32_t>(n.right));
          stack.push_back(static_cast<std::uint32_t>(n.left));
        } else if (q.group() < n.group() && may_collide({self, other}) &&
                   !is_listed({self, other})) {
          visit_pair(worker, {self, other});
        }
      }
    }
    tests.fetch_add(tested, std::memory_order_relaxed);  // read after the end of the job
    worker.ms_busy += busy.lap();
  });
  stats.tree_tests = tests.load(std::memory_order_relaxed);
  double busy = 0;
  for (const auto& worker : workers_) busy += worker->ms_busy;
  count_idle(busy, watch.lap(), stats);
}

void CpuDetector::keep_front(bool reused) {
  front_.clear();
  for (const auto& worker : workers_)
    front_.insert(front_.end(), worker->front.begin(), worker->front.end());
  front_policy_.saved(front_.size(), reused);
}

Span<const Contact> CpuDetector::detect(const Positions& start, const Positions& end,
                                        Stats& stats) {
  Stopwatch total;
  bool started_ahead = join_ahead();
  has_ahead_result_ = false;
  started_ahead = started_ahead && matches_ahead(start, end);
  const bool small =
      is_small(started_ahead && unexpanded_.empty() ? count_undone() : last_candidates_);
  const ScopedWakePolicy helpers(
      pool_, small ? ThreadPool::WakePolicy::awake : ThreadPool::WakePolicy::everyone);
  pool_.prewake();
  const double scale = scale_for(load_records(*mesh_, start, end, pool_, records_));
  started_ahead = started_ahead && scale == scale_;
  scale_ = scale;
  tolerance_ = 0;
  near_pairs_lost_ = false;
  if (started_ahead) {
    stats = ahead_stats_;
    resume(stats);
  } else {
    search(stats);
  }
  stats.started_ahead = started_ahead;
  if (list_state_ == ListState::building) verlet_list_.complete();
  if (list_state_ == ListState::in_use) verlet_list_.record_use(count_searched());
  if (list_state_ == ListState::probing) record_list_probe();

  if (started_ahead && are_sorted_) {
    gather_contacts(late_contacts_, stats);
    merge(late_contacts_, contacts_);
    stats.hash += ahead_stats_.hash;
  } else {
    gather_contacts(contacts_, stats);
  }
  last_candidates_ = stats.candidates_vf + stats.candidates_ee;
  stats.near = count_near();
  stats.ms_traverse =
      std::max(0.0, stats.ms_traverse - stats.ms_narrow - stats.ms_balance - stats.ms_front);
  stats.ms_total = total.lap();
  return contacts_;
}

// Runs a detection from the loaded positions to the contacts of the workers, which are not gathered
// yet.
void CpuDetector::search(Stats& stats) {
  Stopwatch watch;
  stats.groups = 0;
  if (verlet_list_.is_built()) verlet_list_.begin_step(records_, scale_, tolerance_, tree_, pool_);
  const bool all_listed = verlet_list_.is_built() && verlet_list_.holds({0, 0});
  list_state_ = ListState::off;
  if (!all_listed) update_hierarchy(stats);
  if (verlet_list_.is_built()) {
    list_state_ = ListState::in_use;
  } else if (list_state_ == ListState::building) {
    verlet_list_.begin(records_, scale_);
  } else if (may_list()) {
    list_state_ = ListState::probing;
    verlet_list_.begin_step(records_, scale_, tolerance_, tree_, pool_);
  }
  stats.groups = static_cast<std::int64_t>(groups_.groups().size());
  stats.ms_refit = watch.lap();
  begin_workers(options_.separation);
  for (const auto& worker : workers_) {
    worker->near_pairs.clear();
    if (is_running_ahead_) worker->begin_at_start(is_interrupted_);
  }
  unexpanded_.clear();
  if (all_listed) {
    test_pending(true);
  } else {
    traverse(stats);
  }
  stats.ms_traverse = watch.lap();
}

std::int64_t CpuDetector::count_searched() const {
  std::int64_t searched = 0;
  for (const auto& worker : workers_)
    searched += worker->candidates[0] + worker->candidates[1] - worker->from_list;
  return searched;
}

Span<const Contact> CpuDetector::reduce_contacts(Span<const Contact> contacts,
                                                 const Positions& start, const Positions& end,
                                                 Stats& stats) {
  discard_ahead();
  scale_ = scale_for(load_records(*mesh_, start, end, pool_, records_));
  begin_workers(options_.separation);
  for (const auto& worker : workers_) worker->near_pairs.clear();
  contacts_.clear();
  for (std::size_t first = 0, last; first < contacts.size(); first = last) {
    last = first + 1;
    while (last < contacts.size() && contacts[last].kind == contacts[first].kind &&
           last < first + CandidateQueue::capacity)
      ++last;
    workers_.front()->reduce({&contacts[first], last - first}, contacts_);
  }
  stats.contacts_vf = std::count_if(contacts_.begin(), contacts_.end(), is_vertex_face);
  stats.contacts_ee = static_cast<std::int64_t>(contacts_.size()) - stats.contacts_vf;
  stats.near = count_near();
  stats.hash = contact_hash(contacts_);
  return contacts_;
}

std::int64_t CpuDetector::count_near() const {
  std::size_t count = 0;
  for (const auto& worker : workers_)
    for (const std::vector<Candidate>& pairs : worker->near_pairs.of) count += pairs.size();
  return static_cast<std::int64_t>(count);
}

Span<const Contact> CpuDetector::recheck_near_pairs(const Positions& start, const Positions& end,
                                                Stats& stats) {
  Stopwatch total;
  if (near_pairs_lost_)
    throw Error(ErrorCode::invalid_argument,
                "recheck_near_pairs() after detect_ahead(): the near pairs of the last detection "
                "are lost");
  scale_ = scale_for(load_records(*mesh_, start, end, pool_, records_));
  stats.ms_refit = total.lap();
  begin_workers(0);
  if (!stay_apart()) {
    // The workers share the near pairs of each worker.
    for (const auto& from : workers_) {
      for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
        const std::vector<Candidate>& pairs = from->near_pairs.of[static_cast<int>(kind)];
        pool_.parallel_for(pairs.size(), 2048, [&](std::size_t first, std::size_t last, int id) {
          for (std::size_t i = first; i < last; ++i) workers_[id]->push(kind, pairs[i]);
        });
      }
    }
    test_pending(false);
  }
  gather_contacts(rechecked_, stats);
  stats.ms_total = stats.ms_refit + total.lap();
  return rechecked_;
}

// Returns whether no near pair can touch, because the displacements of all vertices differ by less
// than the smallest distance of a near pair.
bool CpuDetector::stay_apart() const {
  double min_distance = std::numeric_limits<double>::infinity();
  for (const auto& worker : workers_)
    min_distance = std::min(min_distance, worker->near_pairs.min_distance);
  double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const VertexRecord& record : records_) {
    for (int k = 0; k < 3; ++k) {
      const double moved = record.x[3 + k] - record.x[k];
      lo[k] = std::min(lo[k], moved);
      hi[k] = std::max(hi[k], moved);
    }
  }
  double squared = 0;
  for (int k = 0; k < 3; ++k) squared += (hi[k] - lo[k]) * (hi[k] - lo[k]);
  return std::sqrt(squared) * (1 + 0x1p-20) < min_distance;
}

std::uint64_t CpuDetector::sort_contacts(std::vector<Contact>& out) {
  std::vector<ContactPart> parts;
  for (const auto& worker : workers_) parts.push_back({worker->contacts, worker->keys});
  return (*sort_)(parts, pool_, out);
}

// Gathers the contacts of the workers, sorted, and adds their counters to the stats.
void CpuDetector::gather_contacts(std::vector<Contact>& out, Stats& stats) {
  Stopwatch watch;
  for (const auto& w : workers_) {
    stats.front_nodes += w->ended;
    stats.group_pairs += w->group_pairs;
    stats.volume_culled += w->culled;
    stats.culled_by_normal_cone += w->flat;
    stats.filtered_noncoplanar += w->filtered_noncoplanar;
    stats.candidates_vf += w->candidates[0];
    stats.candidates_ee += w->candidates[1];
    stats.survivors_vf += w->survived[0];
    stats.survivors_ee += w->survived[1];
    stats.double_precision_tests += w->double_precision_tests;
    stats.exact += w->exact;
    stats.contacts_vf += w->found[0];
    stats.contacts_ee += w->found[1];
    stats.ms_narrow += w->ms / pool_.available();
  }
  stats.hash = sort_contacts(out);
  stats.ms_sort = watch.lap();
  stats.threads = pool_.size();
  stats.peak_bytes = bytes();
  stats.backend = "cpu";
  stats.device = kernels_->name;
}

std::int64_t CpuDetector::bytes() const {
  std::size_t sum =
      records_.capacity() * sizeof(VertexRecord) + groups_.bytes() +
      tree_.nodes().capacity() * sizeof(TreeNode) + node_info_.capacity() * sizeof(NodeInfo) +
      cones_.bytes() + orphans_.bytes() + sort_->bytes() + traversal_.bytes() +
      front_.capacity() * sizeof(NodePair) + verlet_list_.bytes() +
      (contacts_.capacity() + late_contacts_.capacity() + rechecked_.capacity()) * sizeof(Contact);
  for (const auto& w : workers_)
    sum += sizeof(Worker) + w->bytes() + w->front.capacity() * sizeof(NodePair);
  return static_cast<std::int64_t>(sum);
}

}  // namespace lazyccd
