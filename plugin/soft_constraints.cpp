#include "soft_constraints.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <functional>
#include <numeric>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Links to put in order and back take as long as to go over them once.
bool pays(const btSoftBody& body) {
  const btSoftBody::Config& config = body.m_cfg;
  return body.m_links.size() > 0 &&
         config.viterations + config.piterations + config.diterations > 1;
}

// What ReoptimizeLinkOrder() relies on.
bool are_its_own(const btSoftBody& body) {
  if (body.m_nodes.size() < 2) return false;
  const btSoftBody::Node* const first = &body.m_nodes[0];
  const auto is_own = [&](const btSoftBody::Node* node) {
    return !std::less<>()(node, first) && std::less<>()(node, first + body.m_nodes.size());
  };
  for (int i = 0; i < body.m_links.size(); ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    if (!is_own(link.m_n[0]) || !is_own(link.m_n[1])) return false;
  }
  return true;
}

}  // namespace

void SoftConstraints::solve(const btAlignedObjectArray<btSoftBody*>& bodies) {
  orders_.resize(static_cast<std::size_t>(bodies.size()));
  for (int i = 0; i < bodies.size(); ++i) {
    if (!bodies[i]->isActive()) continue;
    if (pays(*bodies[i])) {
      solve(*bodies[i], orders_[i]);
    } else {
      bodies[i]->solveConstraints();
    }
  }
}

void SoftConstraints::solve(btSoftBody& body, Order& order) {
  const btSoftBody::Link* const first = &body.m_links[0];
  links_.assign(first, first + body.m_links.size());
  if (!put_in_order(body, order)) {
    find_order(body, order);
    put_in_order(body, order);
  }
  body.solveConstraints();
  put_back(body, order);
}

// False where the order is of other links.
bool SoftConstraints::put_in_order(btSoftBody& body, const Order& order) const {
  if (order.index.size() != links_.size()) return false;
  bool same = true;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const btSoftBody::Link& link = links_[order.index[i]];
    same = same && link.m_n[0] == order.ends[i][0] && link.m_n[1] == order.ends[i][1];
    body.m_links[static_cast<int>(i)] = link;
  }
  return same;
}

void SoftConstraints::put_back(btSoftBody& body, const Order& order) {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    // What the solver writes.
    const btSoftBody::Link& solved = body.m_links[static_cast<int>(i)];
    btSoftBody::Link& link = links_[order.index[i]];
    link.m_c2 = solved.m_c2;
    link.m_c3 = solved.m_c3;
  }
  std::copy(links_.begin(), links_.end(), &body.m_links[0]);
}

void SoftConstraints::find_order(btSoftBody& body, Order& order) const {
  const int count = static_cast<int>(links_.size());
  std::copy(links_.begin(), links_.end(), &body.m_links[0]);
  order.index.resize(links_.size());
  std::iota(order.index.begin(), order.index.end(), 0);
  if (are_its_own(body)) {
    // The application's tags come back with the links.
    for (int i = 0; i < count; ++i) body.m_links[i].m_tag = &order.index[i];
    btSoftBodyHelpers::ReoptimizeLinkOrder(&body);
    const int* const first = order.index.data();
    std::vector<int> index;
    for (int i = 0; i < count; ++i)
      index.push_back(static_cast<int>(static_cast<const int*>(body.m_links[i].m_tag) - first));
    order.index = std::move(index);
  }
  order.ends.clear();
  for (const int i : order.index) order.ends.push_back({links_[i].m_n[0], links_[i].m_n[1]});
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
