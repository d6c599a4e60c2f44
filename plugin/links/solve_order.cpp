#include "links/solve_order.h"

#include <functional>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Which other bodies the solver of a body reads or writes.
enum class Coupling { itself, rigid_bodies, soft_bodies };

Coupling coupling_of(const btSoftBody& body) {
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

// Number of links times passes over them.
std::int64_t work_of(const btSoftBody& body) {
  const btSoftBody::Config& config = body.m_cfg;
  return (passes_over_links(config.m_vsequence) * config.viterations +
          passes_over_links(config.m_psequence) * config.piterations +
          passes_over_links(config.m_dsequence) * config.diterations) *
         body.m_links.size();
}

}  // namespace

SolveOrder bullets_order(const btAlignedObjectArray<btSoftBody*>& bodies) {
  SolveOrder order;
  for (int i = 0; i < bodies.size(); ++i)
    if (bodies[i]->isActive()) order.serial.push_back(i);
  return order;
}

SolveOrder find_solve_order(const btAlignedObjectArray<btSoftBody*>& bodies) {
  const SolveOrder all_serial = bullets_order(bodies);
  if (all_serial.serial.size() < 2) return all_serial;
  SolveOrder order;
  for (const int i : all_serial.serial) {
    const Coupling coupling = coupling_of(*bodies[i]);
    if (coupling == Coupling::soft_bodies) return all_serial;
    (coupling == Coupling::itself ? order.parallel : order.serial).push_back(i);
  }
  if (order.parallel.size() < 2) return all_serial;
  for (const int i : order.parallel) order.work += work_of(*bodies[i]);
  return order;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
