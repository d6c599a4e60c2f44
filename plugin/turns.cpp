#include "turns.h"

#include <algorithm>
#include <functional>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

enum class Reach { itself, rigid_bodies, soft_bodies };

Reach reach_of(const btSoftBody& body) {
  if (body.m_scontacts.size() > 0) return Reach::soft_bodies;
  const btSoftBody::Node* const first = body.m_nodes.size() > 0 ? &body.m_nodes[0] : nullptr;
  const btSoftBody::Node* const last = first + body.m_nodes.size();
  const auto is_own = [&](const btSoftBody::Node* node) {
    return !std::less<>()(node, first) && std::less<>()(node, last);
  };
  for (int i = 0; i < body.m_links.size(); ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    if (!is_own(link.m_n[0]) || !is_own(link.m_n[1])) return Reach::soft_bodies;
  }
  for (int i = 0; i < body.m_anchors.size(); ++i)
    if (!is_own(body.m_anchors[i].m_node)) return Reach::soft_bodies;
  const bool alone = body.m_anchors.size() == 0 && body.m_rcontacts.size() == 0;
  return alone ? Reach::itself : Reach::rigid_bodies;
}

}  // namespace

std::int64_t passes_over_links(const btSoftBody& body) {
  const btSoftBody::Config& config = body.m_cfg;
  const auto count = [](const auto& sequence, int solver) {
    std::int64_t found = 0;
    for (int i = 0; i < sequence.size(); ++i) found += sequence[i] == solver;
    return found;
  };
  return count(config.m_vsequence, btSoftBody::eVSolver::Linear) * config.viterations +
         count(config.m_psequence, btSoftBody::ePSolver::Linear) * config.piterations +
         count(config.m_dsequence, btSoftBody::ePSolver::Linear) * config.diterations;
}

Turns turns_of(const btAlignedObjectArray<btSoftBody*>& bodies) {
  Turns all;
  for (int i = 0; i < bodies.size(); ++i)
    if (bodies[i]->isActive()) all.in_order.push_back(i);
  if (all.in_order.size() < 2) return all;
  Turns turns;
  for (const int i : all.in_order) {
    const Reach reach = reach_of(*bodies[i]);
    if (reach == Reach::soft_bodies) return all;
    (reach == Reach::itself ? turns.side_by_side : turns.in_order).push_back(i);
  }
  if (turns.side_by_side.size() < 2) return all;
  const auto work = [&](int i) {
    return passes_over_links(*bodies[i]) * bodies[i]->m_links.size();
  };
  std::sort(turns.side_by_side.begin(), turns.side_by_side.end(),
            [&](int a, int b) { return work(a) > work(b); });
  for (const int i : turns.side_by_side) turns.work += work(i);
  return turns;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
