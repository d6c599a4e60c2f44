#include "links/solve_order.h"

#include <algorithm>
#include <functional>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

enum class Coupling { itself, rigid_bodies, soft_bodies };

Coupling reach_of(const btSoftBody& body) {
  if (body.m_scontacts.size() > 0) return Coupling::soft_bodies;
  const btSoftBody::Node* const first = body.m_nodes.size() > 0 ? &body.m_nodes[0] : nullptr;
  const btSoftBody::Node* const last = first + body.m_nodes.size();
  const auto is_own = [&](const btSoftBody::Node* node) {
    return !std::less<>()(node, first) && std::less<>()(node, last);
  };
  for (int i = 0; i < body.m_links.size(); ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    if (!is_own(link.m_n[0]) || !is_own(link.m_n[1])) return Coupling::soft_bodies;
  }
  for (int i = 0; i < body.m_anchors.size(); ++i)
    if (!is_own(body.m_anchors[i].m_node)) return Coupling::soft_bodies;
  const bool alone = body.m_anchors.size() == 0 && body.m_rcontacts.size() == 0;
  return alone ? Coupling::itself : Coupling::rigid_bodies;
}

// Links, each as often as it is gone over.
std::int64_t work_of(const btSoftBody& body) {
  const btSoftBody::Config& config = body.m_cfg;
  return (passes_over_links(config.m_vsequence) * config.viterations +
          passes_over_links(config.m_psequence) * config.piterations +
          passes_over_links(config.m_dsequence) * config.diterations) *
         body.m_links.size();
}

}  // namespace

SolveOrder find_solve_order(const btAlignedObjectArray<btSoftBody*>& bodies) {
  SolveOrder all;
  for (int i = 0; i < bodies.size(); ++i)
    if (bodies[i]->isActive()) all.serial.push_back(i);
  if (all.serial.size() < 2) return all;
  SolveOrder turns;
  for (const int i : all.serial) {
    const Coupling reach = reach_of(*bodies[i]);
    if (reach == Coupling::soft_bodies) return all;
    (reach == Coupling::itself ? turns.parallel : turns.serial).push_back(i);
  }
  if (turns.parallel.size() < 2) return all;
  const auto work = [&](int i) { return work_of(*bodies[i]); };
  std::sort(turns.parallel.begin(), turns.parallel.end(),
            [&](int a, int b) { return work(a) > work(b); });
  for (const int i : turns.parallel) turns.work += work(i);
  return turns;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
