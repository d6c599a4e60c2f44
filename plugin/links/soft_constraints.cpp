#include "links/soft_constraints.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "links/solve_order.h"
#include "scene/soft_scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Solver = btSoftBody::ePSolver;

// Nodes that anchors and rigid contacts move while positions are solved, besides the links. By node
// index; negative if the node belongs to another body.
struct MovedByOthers {
  std::vector<int> anchored, in_contact;

  explicit MovedByOthers(const btSoftBody& body) {
    for (int i = 0; i < body.m_anchors.size(); ++i)
      anchored.push_back(index_of(body, body.m_anchors[i].m_node));
    for (int i = 0; i < body.m_rcontacts.size(); ++i)
      in_contact.push_back(index_of(body, body.m_rcontacts[i].m_node));
  }
  bool any() const { return !anchored.empty() || !in_contact.empty(); }
  bool all_own() const {
    const auto is_own = [](int node) { return node >= 0; };
    return std::all_of(anchored.begin(), anchored.end(), is_own) &&
           std::all_of(in_contact.begin(), in_contact.end(), is_own);
  }
  const std::vector<int>& by(Solver::_ solver) const {
    static const std::vector<int> none;
    if (solver == Solver::Anchors) return anchored;
    return solver == Solver::RContacts ? in_contact : none;
  }
};

// True if the position iterations are the last thing that Bullet's solver does to the body, and
// only this body's nodes move. Drift and clusters come after the positions; contacts between soft
// bodies move nodes of other bodies.
bool ends_with_positions(const btSoftBody& body) {
  return body.m_cfg.diterations <= 0 && body.m_clusters.size() == 0 &&
         body.m_scontacts.size() == 0 && body.m_nodes.size() > 0;
}

// Scope in which Bullet does not solve the positions of the body.
class WithoutPositionIterations {
 public:
  explicit WithoutPositionIterations(btSoftBody& body)
      : iterations_(body.m_cfg.piterations), saved_(std::exchange(iterations_, 0)) {}
  ~WithoutPositionIterations() { iterations_ = saved_; }
  WithoutPositionIterations(const WithoutPositionIterations&) = delete;
  WithoutPositionIterations& operator=(const WithoutPositionIterations&) = delete;

 private:
  int& iterations_;
  int saved_;
};

std::int64_t passes_over_positions(const btSoftBody& body) {
  return passes_over_links(body.m_cfg.m_psequence) * body.m_cfg.piterations;
}

void solve_positions(btSoftBody& body, const MovedByOthers& others, BodyLinks& links) {
  const btSoftBody::tPSolverArray& sequence = body.m_cfg.m_psequence;
  const int iterations = body.m_cfg.piterations;
  if (!others.any()) return links.solve(static_cast<int>(passes_over_positions(body)));
  for (int k = 0; k < iterations; ++k) {
    for (int i = 0; i < sequence.size(); ++i) {
      if (sequence[i] == Solver::Linear) links.solve(1);
      const std::vector<int>& nodes = others.by(sequence[i]);
      if (nodes.empty()) continue;
      for (const int node : nodes) links.write(body, node);
      btSoftBody::getSolver(sequence[i])(&body, 1, static_cast<btScalar>(k) / iterations);
      for (const int node : nodes) links.read(body, node);
    }
  }
}

// What Bullet's solver does to a node after the position iterations. `rate` is velocity by
// distance.
void end_positions(btSoftBody::Node& node, btScalar rate) {
  node.m_v = (node.m_x - node.m_q) * rate;
  node.m_f.setZero();
}

btScalar rate_of(const btSoftBody& body) { return body.m_sst.isdt * (1 - body.m_cfg.kDP); }

// The position iterations of btSoftBody::solveConstraints().
void solve_positions(btSoftBody& body) {
  const btSoftBody::tPSolverArray& sequence = body.m_cfg.m_psequence;
  const int iterations = body.m_cfg.piterations;
  if (iterations <= 0) return;
  for (int k = 0; k < iterations; ++k)
    for (int i = 0; i < sequence.size(); ++i)
      btSoftBody::getSolver(sequence[i])(&body, 1, static_cast<btScalar>(k) / iterations);
  const btScalar rate = rate_of(body);
  for (int i = 0; i < body.m_nodes.size(); ++i) end_positions(body.m_nodes[i], rate);
}

}  // namespace

void SoftConstraints::solve(const btAlignedObjectArray<btSoftBody*>& bodies,
                            const ParallelFor& parallel_for, int threads) {
  links_.resize(static_cast<std::size_t>(bodies.size()));
  is_prepared_.assign(links_.size(), 0);
  const SolveOrder order = threads > 1 ? find_solve_order(bodies) : bullets_order(bodies);
  for (const int i : order.serial) is_prepared_[i] = solve(*bodies[i], links_[i]);
  const std::vector<int>& parallel = order.parallel;
  if (parallel.empty()) return;
  // With at most three tasks, parallel_for() wakes no sleeping threads. For less work than this
  // (links times passes), waking a thread takes longer than the work.
  constexpr std::int64_t min_parallel_work = 1 << 16;
  const std::size_t tasks = order.work < min_parallel_work
                                ? std::min<std::size_t>(parallel.size(), 3)
                                : std::max<std::size_t>(parallel.size(), 4);
  for_ranges(parallel_for, tasks, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t task = first; task < last; ++task)
      for (std::size_t i = task; i < parallel.size(); i += tasks)
        is_prepared_[parallel[i]] = solve(*bodies[parallel[i]], links_[parallel[i]]);
  });
}

// Bullet prepares the links and anchors and solves the velocities; the positions are solved here.
// Bullet's method allocates memory at its end too. Where positions come last, they are solved after
// it, so that nothing has moved if an allocation fails.
bool SoftConstraints::solve(btSoftBody& body, BodyLinks& links) {
  if (!ends_with_positions(body)) {
    body.solveConstraints();
    return false;
  }
  const MovedByOthers others(body);
  const bool is_prepared = others.all_own() && links.prepare(body, passes_over_positions(body));
  {
    const WithoutPositionIterations scope(body);
    body.solveConstraints();
  }
  if (!is_prepared) {
    solve_positions(body);
    return false;
  }
  links.read(body);
  solve_positions(body, others, links);
  const btScalar rate = rate_of(body);
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    links.write(body, i);
    end_positions(body.m_nodes[i], rate);
  }
  return true;
}

void SoftConstraints::solve_links_again(btSoftBody& body, int index, int iterations) {
  const int passes = static_cast<int>(passes_over_links(body.m_cfg.m_psequence)) * iterations;
  if (!is_prepared_[static_cast<std::size_t>(index)]) {
    for (int i = 0; i < passes; ++i) btSoftBody::getSolver(Solver::Linear)(&body, 1, 0);
    return;
  }
  BodyLinks& links = links_[static_cast<std::size_t>(index)];
  links.read(body);
  links.solve(passes);
  links.write(body);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
