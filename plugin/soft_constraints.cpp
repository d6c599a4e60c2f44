#include "soft_constraints.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include "float_mode.h"
#include "soft_scene.h"
#include "turns.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Links that share a node with one of the few before them, which are not done yet when they begin.
int count_waiting(const btAlignedObjectArray<btSoftBody::Link>& links,
                  const std::vector<int>& index) {
  constexpr std::size_t window = 3;
  int waiting = 0;
  for (std::size_t i = 0; i < index.size(); ++i) {
    const btSoftBody::Link& link = links[index[i]];
    const auto first = index.begin() + static_cast<std::ptrdiff_t>(i - std::min(i, window));
    waiting += std::any_of(first, index.begin() + static_cast<std::ptrdiff_t>(i), [&](int other) {
      const btSoftBody::Link& before = links[other];
      return link.m_n[0] == before.m_n[0] || link.m_n[0] == before.m_n[1] ||
             link.m_n[1] == before.m_n[0] || link.m_n[1] == before.m_n[1];
    });
  }
  return waiting;
}

// In which ReoptimizeLinkOrder() puts the links; their own order where it would not take them.
std::vector<int> best_order(const btSoftBody& body) {
  std::vector<int> index(static_cast<std::size_t>(body.m_links.size()));
  std::iota(index.begin(), index.end(), 0);
  if (body.m_nodes.size() < 2) return index;
  // It permutes the links themselves, so it gets others, of as many nodes with nothing in them.
  btSoftBodyWorldInfo info;
  btSoftBody links_alone(&info);
  static const btSoftBody::Node nothing{};
  links_alone.m_nodes.resize(body.m_nodes.size(), nothing);
  links_alone.m_links.copyFromArray(body.m_links);
  std::vector<int> tags = index;
  for (int i = 0; i < body.m_links.size(); ++i) {
    btSoftBody::Link& link = links_alone.m_links[i];
    link.m_tag = &tags[i];
    for (btSoftBody::Node*& node : link.m_n) {
      const int own = index_of(body, node);
      if (own < 0) return index;
      node = &links_alone.m_nodes[own];
    }
  }
  btSoftBodyHelpers::ReoptimizeLinkOrder(&links_alone);
  for (int i = 0; i < body.m_links.size(); ++i)
    index[i] = *static_cast<const int*>(links_alone.m_links[i].m_tag);
  return index;
}

}  // namespace

void SoftConstraints::solve(const btAlignedObjectArray<btSoftBody*>& bodies,
                            const ParallelFor& parallel_for) {
  orders_.resize(static_cast<std::size_t>(bodies.size()));
  links_.resize(orders_.size());
  const Turns turns = turns_of(bodies);
  for (const int i : turns.in_order) solve(*bodies[i], i);
  const std::vector<int>& rest = turns.side_by_side;
  if (rest.empty()) return;
  // Fewer than four pieces wake nobody; a thread that sleeps comes later than so little is done.
  constexpr std::int64_t little = 1 << 15;
  const std::size_t pieces = turns.work < little ? std::min<std::size_t>(rest.size(), 3)
                                                 : std::max<std::size_t>(rest.size(), 4);
  const FloatMode callers;
  parallel_for(pieces, 1, [&](std::size_t first, std::size_t last) {
    const WithFloatMode mode(callers);
    for (std::size_t piece = first; piece < last; ++piece)
      for (std::size_t i = piece; i < rest.size(); i += pieces) solve(*bodies[rest[i]], rest[i]);
  });
}

void SoftConstraints::solve(btSoftBody& body, int index) {
  Order& order = orders_[index];
  Links& links = links_[index];
  if (order.count != body.m_links.size()) order = find_order(body);
  if (!pays(body, order)) return body.solveConstraints();
  const btSoftBody::Link* const first = &body.m_links[0];
  links.assign(first, first + body.m_links.size());
  if (!put_in_order(body, order, links)) {
    std::copy(links.begin(), links.end(), &body.m_links[0]);
    order = find_order(body);
    if (!pays(body, order)) return body.solveConstraints();
    put_in_order(body, order, links);
  }
  body.solveConstraints();
  put_back(body, order, links);
}

// In nanoseconds (AMD EPYC): a link that waits takes 6 more each time, to put one in order and back
// takes 8, and 16 where they are more than the processor keeps near.
bool SoftConstraints::pays(const btSoftBody& body, const Order& order) {
  constexpr std::int64_t wait = 6, near = 8, far = 16, most_near = 6000;
  const std::int64_t count = order.count;
  return passes_over_links(body) * order.waiting * wait > count * (count < most_near ? near : far);
}

SoftConstraints::Order SoftConstraints::find_order(const btSoftBody& body) {
  Order order;
  order.count = body.m_links.size();
  std::vector<int> own(static_cast<std::size_t>(order.count));
  std::iota(own.begin(), own.end(), 0);
  const int waiting = count_waiting(body.m_links, own);
  if (waiting == 0) return order;
  order.index = best_order(body);
  order.waiting = waiting - count_waiting(body.m_links, order.index);
  for (const int i : order.index) {
    const btSoftBody::Link& link = body.m_links[i];
    order.ends.push_back({link.m_n[0], link.m_n[1]});
  }
  return order;
}

// False where the order is of other links.
bool SoftConstraints::put_in_order(btSoftBody& body, const Order& order, const Links& links) {
  bool same = true;
  for (std::size_t i = 0; i < links.size(); ++i) {
    const btSoftBody::Link& link = links[order.index[i]];
    same = same && link.m_n[0] == order.ends[i][0] && link.m_n[1] == order.ends[i][1];
    body.m_links[static_cast<int>(i)] = link;
  }
  return same;
}

void SoftConstraints::put_back(btSoftBody& body, const Order& order, Links& links) {
  for (std::size_t i = 0; i < links.size(); ++i) {
    // What the solver writes.
    const btSoftBody::Link& solved = body.m_links[static_cast<int>(i)];
    btSoftBody::Link& link = links[order.index[i]];
    link.m_c2 = solved.m_c2;
    link.m_c3 = solved.m_c3;
  }
  std::copy(links.begin(), links.end(), &body.m_links[0]);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
