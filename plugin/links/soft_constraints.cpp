#include "links/soft_constraints.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "util/float_environment.h"
#include "scene/soft_scene.h"
#include "links/solve_order.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Solver = btSoftBody::ePSolver;

// Nodes that others than links move while positions are solved: by their index, negative where they
// are another body's.
struct MovedBeside {
  std::vector<int> anchored, touching;

  explicit MovedBeside(const btSoftBody& body) {
    for (int i = 0; i < body.m_anchors.size(); ++i)
      anchored.push_back(index_of(body, body.m_anchors[i].m_node));
    for (int i = 0; i < body.m_rcontacts.size(); ++i)
      touching.push_back(index_of(body, body.m_rcontacts[i].m_node));
  }
  bool any() const { return !anchored.empty() || !touching.empty(); }
  bool all_own() const {
    const auto is_own = [](int node) { return node >= 0; };
    return std::all_of(anchored.begin(), anchored.end(), is_own) &&
           std::all_of(touching.begin(), touching.end(), is_own);
  }
  const std::vector<int>& by(Solver::_ solver) const {
    static const std::vector<int> none;
    if (solver == Solver::Anchors) return anchored;
    return solver == Solver::RContacts ? touching : none;
  }
};

// Drift and clusters come after the positions; contacts of soft bodies move nodes of others.
bool ends_with_positions(const btSoftBody& body) {
  return body.m_cfg.diterations <= 0 && body.m_clusters.size() == 0 &&
         body.m_scontacts.size() == 0 && body.m_nodes.size() > 0;
}

// While it lives, Bullet leaves the body's positions as they are.
class WithoutPositions {
 public:
  explicit WithoutPositions(btSoftBody& body)
      : iterations_(body.m_cfg.piterations), kept_(std::exchange(iterations_, 0)) {}
  ~WithoutPositions() { iterations_ = kept_; }
  WithoutPositions(const WithoutPositions&) = delete;
  WithoutPositions& operator=(const WithoutPositions&) = delete;

 private:
  int& iterations_;
  int kept_;
};

std::int64_t passes_over_positions(const btSoftBody& body) {
  return passes_over_links(body.m_cfg.m_psequence) * body.m_cfg.piterations;
}

void solve_positions(btSoftBody& body, const MovedBeside& beside, BodyLinks& links) {
  const btSoftBody::tPSolverArray& sequence = body.m_cfg.m_psequence;
  const int iterations = body.m_cfg.piterations;
  if (!beside.any()) return links.solve(static_cast<int>(passes_over_positions(body)));
  for (int k = 0; k < iterations; ++k) {
    for (int i = 0; i < sequence.size(); ++i) {
      if (sequence[i] == Solver::Linear) links.solve(1);
      const std::vector<int>& nodes = beside.by(sequence[i]);
      if (nodes.empty()) continue;
      for (const int node : nodes) links.write(body, node);
      btSoftBody::getSolver(sequence[i])(&body, 1, static_cast<btScalar>(k) / iterations);
      for (const int node : nodes) links.read(body, node);
    }
  }
}

}  // namespace

void SoftConstraints::solve(const btAlignedObjectArray<btSoftBody*>& bodies,
                            const ParallelFor& parallel_for) {
  links_.resize(static_cast<std::size_t>(bodies.size()));
  const SolveOrder turns = find_solve_order(bodies);
  for (const int i : turns.serial) solve(*bodies[i], links_[i]);
  const std::vector<int>& rest = turns.parallel;
  if (rest.empty()) return;
  // Fewer than four pieces wake nobody; a thread that sleeps comes later than so little is done.
  constexpr std::int64_t little = 1 << 16;
  const std::size_t pieces = turns.work < little ? std::min<std::size_t>(rest.size(), 3)
                                                 : std::max<std::size_t>(rest.size(), 4);
  const FloatMode callers;
  parallel_for(pieces, 1, [&](std::size_t first, std::size_t last) {
    const WithFloatMode mode(callers);
    for (std::size_t piece = first; piece < last; ++piece)
      for (std::size_t i = piece; i < rest.size(); i += pieces)
        solve(*bodies[rest[i]], links_[rest[i]]);
  });
}

// Bullet prepares the links and anchors and solves the velocities.
void SoftConstraints::solve(btSoftBody& body, BodyLinks& links) {
  const MovedBeside beside(body);
  if (!ends_with_positions(body) || !beside.all_own() ||
      !links.take(body, passes_over_positions(body)))
    return body.solveConstraints();
  {
    const WithoutPositions without(body);
    body.solveConstraints();
  }
  links.read(body);
  solve_positions(body, beside, links);
  links.write(body);
  const btScalar rate = body.m_sst.isdt * (1 - body.m_cfg.kDP);
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    btSoftBody::Node& node = body.m_nodes[i];
    node.m_v = (node.m_x - node.m_q) * rate;
    node.m_f.setZero();
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
