#include "links/soft_constraints.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "links/solve_order.h"
#include "scene/soft_scene.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Solver = btSoftBody::ePSolver;

// Nodes that anchors and rigid contacts move while positions are solved, besides the links. By node
// index; negative if the node belongs to another body.
struct MovedByOthers {
  ScratchVector<int> anchored, in_contact;

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
  Span<const int> by(Solver::_ solver) const {
    if (solver == Solver::Anchors) return anchored;
    if (solver == Solver::RContacts) return in_contact;
    return {};
  }
};

// True if the position iterations are the last thing that Bullet's solver does to the body, and
// only this body's nodes move. Drift and clusters come after the positions; contacts between soft
// bodies move nodes of other bodies.
bool ends_with_positions(const btSoftBody& body) {
  return body.m_cfg.diterations <= 0 && body.m_clusters.size() == 0 &&
         body.m_scontacts.size() == 0 && body.m_nodes.size() > 0;
}

// Bodies with fewer links than this do not fill the groups of links. Without kernels there are
// none.
bool is_small(const btSoftBody& body) {
  constexpr int few_links = 192;
  static const bool has_kernels = best_link_kernels() != nullptr;
  return has_kernels && body.m_links.size() < few_links;
}

bool has_small_bodies(const btAlignedObjectArray<btSoftBody*>& bodies) {
  int count = 0;
  for (int i = 0; i < bodies.size() && count < 2; ++i)
    count += bodies[i]->isActive() && is_small(*bodies[i]);
  return count > 1;
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
      const Span<const int> nodes = others.by(sequence[i]);
      if (nodes.empty()) continue;
      for (const int node : nodes) links.write(node);
      btSoftBody::getSolver(sequence[i])(&body, 1, static_cast<btScalar>(k) / iterations);
      for (const int node : nodes) links.read(node);
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

void SoftConstraints::solve(const Bodies& bodies, const ParallelFor& parallel_for, int threads) {
  links_.resize(static_cast<std::size_t>(bodies.size()));
  states_.assign(links_.size(), LinksState::bullets);
  const SolveOrder order =
      threads > 1 || has_small_bodies(bodies) ? find_solve_order(bodies) : bullets_order(bodies);
  for (const int i : order.serial) solve_alone(*bodies[i], i);
  if (order.parallel.empty()) return;
  make_tasks(bodies, order.parallel);
  // With at most three ranges, parallel_for() wakes no sleeping threads. For less work than this
  // (links times passes), waking a thread takes longer than the work.
  constexpr std::int64_t min_parallel_work = 1 << 16;
  const std::size_t ranges = order.work < min_parallel_work
                                 ? std::min<std::size_t>(tasks_.size(), 3)
                                 : std::max<std::size_t>(tasks_.size(), 4);
  for_ranges(parallel_for, ranges, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t range = first; range < last; ++range)
      for (std::size_t i = range; i < tasks_.size(); i += ranges) {
        const auto [block, body] = tasks_[i];
        block ? solve_block(*block) : solve_alone(*bodies[body], body);
      }
  });
}

// Blocks begin at places in the world's list that do not depend on what the bodies do. So a body
// that falls asleep changes no other block.
void SoftConstraints::make_tasks(const Bodies& bodies, Span<const int> parallel) {
  constexpr int links_of_block = 512;
  tasks_.clear();
  int links = 0, next = 0;  // links of the small bodies before the next one in the world
  std::size_t last_block = 0;
  alone_.clear();
  for (const int index : parallel) {
    for (; next < index; ++next)
      if (is_small(*bodies[next])) links += bodies[next]->m_links.size();
    btSoftBody& body = *bodies[index];
    if (!is_small(body) || !ends_with_positions(body)) {
      alone_.push_back(index);
      continue;
    }
    const auto number = static_cast<std::size_t>(links / links_of_block);
    while (blocks_.size() <= number) blocks_.push_back(std::make_unique<Block>());
    Block& block = *blocks_[number];
    if (tasks_.empty() || number != last_block) {
      last_block = number;
      block.indices.clear();
      block.bodies.clear();
      tasks_.push_back({&block, 0});
    } else if (passes_over_positions(*block.bodies[0]) != passes_over_positions(body)) {
      alone_.push_back(index);
      continue;
    }
    block.bodies.push_back(&body);
    block.indices.push_back(index);
  }
  // Most work first.
  std::sort(alone_.begin(), alone_.end(), [&](int a, int b) {
    return std::make_pair(-bodies[a]->m_links.size(), a) <
           std::make_pair(-bodies[b]->m_links.size(), b);
  });
  for (const int index : alone_) tasks_.push_back({nullptr, index});
}

void SoftConstraints::solve_block(Block& block) {
  const bool is_solved = solve_together(block);
  for (std::size_t i = 0; i < block.bodies.size(); ++i) {
    const int index = block.indices[i];
    if (is_solved)
      states_[static_cast<std::size_t>(index)] = LinksState::unknown;
    else
      solve_alone(*block.bodies[i], index);
  }
}

// Returns false, and changes no body, if the bodies are better solved one by one. A plan is made
// when they have stayed together for a step, so that bodies that come and go cost none.
bool SoftConstraints::solve_together(Block& block) {
  const std::vector<btSoftBody*>& bodies = block.bodies;
  if (bodies.size() < 2) return false;
  if (block.last_bodies != bodies) {
    block.last_bodies = bodies;
    return false;
  }
  const std::int64_t passes = passes_over_positions(*bodies[0]);
  if (!block.links.prepare({bodies.data(), bodies.size()}, passes)) return false;
  std::size_t count = 0;  // of bodies without their positions
  try {
    for (btSoftBody* const body : bodies) {
      const WithoutPositionIterations scope(*body);
      body->solveConstraints();
      ++count;
    }
  } catch (...) {
    for (std::size_t i = 0; i < count; ++i) solve_positions(*bodies[i]);
    throw;
  }
  block.links.read();
  block.links.solve(static_cast<int>(passes));
  block.links.write();
  for (btSoftBody* const body : bodies) {
    const btScalar rate = rate_of(*body);
    for (int i = 0; i < body->m_nodes.size(); ++i) end_positions(body->m_nodes[i], rate);
  }
  return true;
}

void SoftConstraints::solve_alone(btSoftBody& body, int index) {
  const bool is_prepared = solve_body(body, links_[static_cast<std::size_t>(index)]);
  states_[static_cast<std::size_t>(index)] =
      is_prepared ? LinksState::prepared : LinksState::bullets;
}

// Bullet prepares the links and anchors and solves the velocities; the positions are solved here.
// Bullet's method allocates memory at its end too. Where positions come last, they are solved after
// it, so that nothing has moved if an allocation fails.
// Returns whether `links` solved them, and not Bullet.
bool SoftConstraints::solve_body(btSoftBody& body, BodyLinks& links) {
  btSoftBody* const pointer = &body;
  if (!ends_with_positions(body)) {
    body.solveConstraints();
    return false;
  }
  const MovedByOthers others(body);
  const bool is_prepared =
      others.all_own() && links.prepare({&pointer, 1}, passes_over_positions(body));
  {
    const WithoutPositionIterations scope(body);
    body.solveConstraints();
  }
  if (!is_prepared) {
    solve_positions(body);
    return false;
  }
  links.read();
  solve_positions(body, others, links);
  const btScalar rate = rate_of(body);
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    links.write(i);
    end_positions(body.m_nodes[i], rate);
  }
  return true;
}

void SoftConstraints::solve_links_again(btSoftBody& body, int index, Span<btVector3> positions) {
  const int passes = static_cast<int>(passes_over_links(body.m_cfg.m_psequence));
  LinksState& state = states_[static_cast<std::size_t>(index)];
  BodyLinks& links = links_[static_cast<std::size_t>(index)];
  if (state == LinksState::unknown) {
    btSoftBody* const pointer = &body;
    const bool is_prepared =
        links.prepare({&pointer, 1}, std::max<std::int64_t>(passes, passes_over_positions(body)));
    state = is_prepared ? LinksState::prepared : LinksState::bullets;
  }
  if (state == LinksState::prepared) return links.solve(passes, positions);
  const auto exchange = [&] {
    for (std::size_t i = 0; i < positions.size(); ++i)
      std::swap(body.m_nodes[static_cast<int>(i)].m_x, positions[i]);
  };
  exchange();
  for (int i = 0; i < passes; ++i) btSoftBody::getSolver(Solver::Linear)(&body, 1, 0);
  exchange();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
