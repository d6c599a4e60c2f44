#include "cpu/cpu_detector.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <string>

#include "core/narrow/contact_math.h"
#include "core/narrow/separation.h"
#include "core/profile.h"
#include "cpu/balanced_traversal.h"
#include "cpu/detector_worker.h"
#include "cpu/extension.h"
#include "cpu/narrow/candidate_batches.h"
#include "cpu/strategies/lazy_stealing.h"
#include "host/extension.h"
#include "host/scene/positions.h"
#include "host/scene/scale.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/debug/assert.h"
#include "lazyccd/debug/stopwatch.h"

namespace lazyccd {
namespace {

std::unique_ptr<TraversalRun> make_traversal(ThreadPool& pool, const AlgorithmOptions& options) {
  if (options.strategy != Strategy::lazy_stealing)
    return find_extension(options)->cpu->make_traversal(pool, options.strategy, options.tuning);
  return std::make_unique<BalancedTraversal<LazyStealing<NodePair>>>(
      pool, 0u, 0u, static_cast<std::uint32_t>(options.tuning.chunk));
}

std::unique_ptr<NodeCulling> make_culling(const DetectorOptions& options) {
  if (!culls_nodes(options)) return nullptr;
  return find_extension(options.algorithm)
      ->cpu->make_culling(options, separation_margin(options.separation));
}

std::unique_ptr<ExcludedPairs> make_excluded_pairs(const DetectorOptions& options) {
  if (!excludes_pairs(options)) return nullptr;
  return find_extension(options.algorithm)->cpu->make_excluded_pairs();
}

}  // namespace

CpuDetector::CpuDetector(const DetectorOptions& options, const Threads& threads,
                         const LeafKernels& kernels)
    : options_(options),
      kernels_(&kernels),
      threads_(threads),
      pool_(threads_.pool()),
      traversal_(make_traversal(pool_, options.algorithm)),
      hierarchy_(options.algorithm, separation_margin(options.separation), kernels,
                 make_culling(options)),
      excluded_(make_excluded_pairs(options)),
      front_policy_(options.algorithm.front_period, options.algorithm.front_ratio),
      verlet_list_(options.separation, pool_.size()) {
  // Reduction keeps a vertex-face pair in place of others. Without vertex-face tests it would be
  // missing.
  options_.reduce_contacts = options.reduce_contacts && options.vertex_face;
  for (int i = 0; i < pool_.size(); ++i) workers_.push_back(std::make_unique<Worker>());
  for (const auto& worker : workers_) narrow_phases_.push_back(worker.get());
}

CpuDetector::~CpuDetector() { discard_ahead(); }

void CpuDetector::set_mesh(const Mesh& mesh) {
  discard_ahead();
  near_pairs_lost_ = near_pairs_are_taken_ = false;
  mesh_ = &mesh;
  hierarchy_.forget();
  front_policy_.forget();
  verlet_list_.forget();
  last_motion_is_kept_ = false;
  sort_ = std::make_unique<ContactSort>(mesh);
  for (const auto& worker : workers_) worker->near_pairs.clear();
  if (excluded_) excluded_->set_mesh(mesh);
}

void CpuDetector::update_resting() {
  near_pairs_lost_ = true;
  hierarchy_.update_resting(pool_);
}

void CpuDetector::update_hierarchy(Stats& stats) {
  LAZYCCD_NVTX_RANGE("refit");
  const bool builds_list =
      may_list() && !verlet_list_.has_list() && verlet_list_.is_worthwhile(scale_);
  list_state_ = builds_list ? ListState::building : ListState::off;
  const double margin = separation_margin(options_.separation) +
                        (builds_list ? verlet_list_.skin() : 0) + tolerance_ * (1 + 0x1p-20);
  stats.rebuilt = hierarchy_.update(*mesh_, records_, scale_, margin, pool_);
  if (!stats.rebuilt) return;
  front_policy_.forget();
  if (may_list()) verlet_list_.set_tree(*mesh_, hierarchy_.groups(), hierarchy_.tree(), pool_);
}

// Whether Verlet lists are possible. Only boxes have a margin for the skin.
bool CpuDetector::may_list() const {
  return options_.separation > 0 && !hierarchy_.culling() && !options_.algorithm.rebuild_every_step;
}

LeafScene CpuDetector::leaf_scene(double separation, Worker& worker) const {
  LAZYCCD_ASSERT(records_.size() == mesh_->vertex_count(), "each vertex has a position");
  return {hierarchy_.groups().groups().data(),
          hierarchy_.groups().boxes().data(),
          hierarchy_.groups().blocks().data(),
          records_.empty() ? nullptr : records_.data()->x,
          mesh_->view(),
          scale_,
          options_.vertex_face,
          options_.edge_edge,
          {separation, mesh_->self_separation()},
          static_cast<float>(2 * tolerance_ * scale_),
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

void CpuDetector::record_list_use() {
  std::int64_t visited = 0, listable = 0, candidates = 0;
  for (const auto& worker : workers_) {
    visited += worker->group_pairs;
    listable += worker->listable;
    candidates += worker->candidates[0] + worker->candidates[1];
  }
  if (list_state_ == ListState::building) verlet_list_.finish_building(visited, candidates);
  if (list_state_ == ListState::in_use) verlet_list_.record_use(visited, candidates);
  if (list_state_ == ListState::probing)
    verlet_list_.record_probe(visited, candidates, 4 * listable > visited);
}

Span<const Contact> CpuDetector::detect(const Positions& start, const Positions& end,
                                        Stats& stats) {
  LAZYCCD_NVTX_RANGE("detect");
  Stopwatch total;
  bool started_ahead = join_ahead();
  has_ahead_result_ = false;
  started_ahead = started_ahead && matches_ahead(start, end);
  const bool small =
      is_small(started_ahead && unexpanded_.empty() ? count_undone() : last_candidates_);
  const ScopedWakePolicy helpers(
      pool_, small ? ThreadPool::WakePolicy::awake : ThreadPool::WakePolicy::everyone);
  pool_.prewake();
  if (!started_ahead) keep_last_motion();
  const double scale = scale_for(load_records(*mesh_, start, end, pool_, records_));
  started_ahead = started_ahead && scale == scale_;
  scale_ = scale;
  tolerance_ = 0;
  near_pairs_lost_ = true;  // until the search has ended
  last_motion_is_kept_ = false;
  try {
    if (started_ahead) {
      stats = ahead_stats_;
      resume(stats);
    } else {
      search(stats);
    }
  } catch (...) {  // what was built halfway fits nothing
    hierarchy_.forget();
    verlet_list_.forget();
    throw;
  }
  near_pairs_lost_ = near_pairs_are_taken_ = false;
  stats.started_ahead = started_ahead;
  record_list_use();

  if (started_ahead && are_sorted_) {
    gather_contacts(late_contacts_, stats);
    merge(late_contacts_, mesh_->contact_order(), contacts_);
    stats.hash += ahead_stats_.hash;
  } else {
    gather_contacts(contacts_, stats);
  }
  LAZYCCD_ASSERT(
      stats.contacts_vf + stats.contacts_ee == static_cast<std::int64_t>(contacts_.size()),
      "the workers count the contacts that they return");
  last_candidates_ = stats.candidates_vf + stats.candidates_ee;
  describe_near(stats);
  stats.ms_traverse =
      std::max(0.0, stats.ms_traverse - stats.ms_narrow - stats.ms_balance - stats.ms_front);
  stats.ms_total = total.lap();
  return contacts_;
}

// Runs a detection from the loaded positions to the contacts of the workers, which are not gathered
// yet.
void CpuDetector::search(Stats& stats) {
  Stopwatch watch;
  is_rechecking_ = false;  // also after a re-check that an exception ended
  stats.groups = 0;
  if (verlet_list_.has_list())
    verlet_list_.begin_step(records_, tolerance_, hierarchy_.tree(), pool_);
  const bool all_listed = verlet_list_.has_list() && verlet_list_.covers({0, 0});
  list_state_ = ListState::off;
  if (!all_listed) update_hierarchy(stats);
  if (verlet_list_.has_list()) {
    list_state_ = ListState::in_use;
  } else if (list_state_ == ListState::off && may_list()) {
    list_state_ = ListState::probing;
  }
  if (list_state_ != ListState::off && !all_listed)
    verlet_list_.measure_step(last_motion_, records_, scale_, hierarchy_.tree(), pool_);
  if (list_state_ == ListState::building) verlet_list_.begin_building(records_, scale_);
  stats.groups = static_cast<std::int64_t>(hierarchy_.groups().groups().size());
  stats.ms_refit = watch.lap();
  begin_workers(options_.separation);
  for (const auto& worker : workers_) {
    worker->near_pairs.clear();
    if (is_running_ahead_) worker->limit_to_start(is_interrupted_);
  }
  unexpanded_.clear();
  if (all_listed) {
    test_pending(true);
  } else {
    traverse(stats);
  }
  stats.ms_traverse = watch.lap();
}

std::vector<Contact> CpuDetector::take_contacts(Span<const Contact> contacts,
                                                std::vector<Contact> reuse) {
  if (contacts.data() == contacts_.data()) {
    contacts_.swap(reuse);
    return reuse;
  }
  constexpr std::size_t grain = 4096;  // contacts; more work than it costs to distribute them
  reuse.resize(contacts.size());
  pool_.parallel_for(contacts.size(), grain, [&](std::size_t first, std::size_t last, int) {
    std::copy(contacts.begin() + first, contacts.begin() + last, reuse.begin() + first);
  });
  return reuse;
}

void CpuDetector::begin_near_distances() {
  near_distances_.resize(mesh_->body_count());
  const Separations separation{options_.separation, mesh_->self_separation()};
  for (std::size_t body = 0; body < near_distances_.size(); ++body) {
    const float least = mesh_->least_self_separation(body);
    near_distances_[body] = separation.within(least, least);
  }
  nearest_ = options_.separation;
}

void CpuDetector::add_near_distances(Span<const double> of_pairs) {
  for (std::size_t body = 0; body < of_pairs.size(); ++body) {
    near_distances_[body] = std::min(near_distances_[body], of_pairs[body]);
    nearest_ = std::min(nearest_, of_pairs[body]);
  }
  LAZYCCD_ASSERT(std::all_of(near_distances_.begin(), near_distances_.end(),
                             [this](double d) { return d >= 0 && d <= options_.separation; }),
                 "distances of near pairs are within the separation");
}

void CpuDetector::take_near_distances(Span<const double> of_pairs) {
  discard_ahead();
  near_pairs_lost_ = true;
  begin_near_distances();
  add_near_distances(of_pairs);
}

void CpuDetector::take_near_pairs(const std::array<Span<const Candidate>, 2>& pairs) {
  for (const auto& worker : workers_) worker->near_pairs.clear();
  for (std::size_t kind = 0; kind < 2; ++kind)
    workers_[0]->near_pairs.of[kind].assign(pairs[kind].begin(), pairs[kind].end());
  near_pairs_lost_ = false;
  near_pairs_are_taken_ = true;
}

void CpuDetector::describe_near(Stats& stats) {
  stats.near_pairs = 0;
  if (!(options_.separation > 0)) return;
  begin_near_distances();
  for (const auto& worker : workers_) {
    const NearPairs& near = worker->near_pairs;
    stats.near_pairs += static_cast<std::int64_t>(near.of[0].size() + near.of[1].size());
    add_near_distances(near.min_distance);
  }
}

void CpuDetector::keep_last_motion() {
  if (!last_motion_is_kept_) last_motion_.swap(records_);
  last_motion_is_kept_ = true;
}

std::uint64_t CpuDetector::sort_contacts(std::vector<Contact>& out) {
  LAZYCCD_NVTX_RANGE("sort");
  parts_.clear();
  for (const auto& worker : workers_) parts_.push_back({worker->contacts, worker->keys});
  return (*sort_)(parts_, pool_, out);
}

// Gathers the contacts of the workers, sorted, and adds their counters to the stats.
void CpuDetector::gather_contacts(std::vector<Contact>& out, Stats& stats) {
  Stopwatch watch;
  for (const auto& w : workers_) {
    stats.front_nodes += w->ended;
    stats.group_pairs += w->group_pairs;
    stats.culled_by_volume += w->culled;
    stats.culled_by_normal_cone += w->flat;
    stats.filtered_noncoplanar += w->filtered_noncoplanar;
    stats.candidates_vf += w->candidates[0];
    stats.candidates_ee += w->candidates[1];
    stats.listed_candidates += w->listed_candidates;
    stats.survivors_vf += w->survived[0];
    stats.survivors_ee += w->survived[1];
    stats.double_precision_tests += w->double_precision_tests;
    stats.exact_tests += w->exact_tests;
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
      records_.capacity() * sizeof(VertexRecord) + hierarchy_.bytes() +
      (excluded_ ? excluded_->bytes() : 0) + sort_->bytes() + traversal_->bytes() +
      front_.capacity() * sizeof(NodePair) + verlet_list_.bytes() +
      last_motion_.capacity() * sizeof(VertexRecord) + deviation_.bytes() +
      (contacts_.capacity() + late_contacts_.capacity() + rechecked_.capacity()) * sizeof(Contact);
  for (const auto& w : workers_)
    sum += sizeof(Worker) + w->bytes() + w->front.capacity() * sizeof(NodePair);
  return static_cast<std::int64_t>(sum);
}

}  // namespace lazyccd
