#include "bodies/side_by_side.h"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "scene/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool has_only_own_nodes(const btSoftBody& body) {
  const btSoftBody::Node* const first = body.m_nodes.size() > 0 ? &body.m_nodes[0] : nullptr;
  const btSoftBody::Node* const last = first + body.m_nodes.size();
  const auto all_own = [&](const auto& elements) {
    bool own = true;
    for (int i = 0; i < elements.size(); ++i)
      for (const btSoftBody::Node* node : elements[i].m_n)
        own &= !std::less<>()(node, first) && std::less<>()(node, last);
    return own;
  };
  for (int i = 0; i < body.m_deformableAnchors.size(); ++i)
    if (index_of(body, body.m_deformableAnchors[i].m_node) < 0) return false;
  return all_own(body.m_faces) && all_own(body.m_links) && all_own(body.m_tetras);
}

void SideBySide::begin(const Bodies& bodies) {
  constexpr int few_nodes = 2048;
  order_.resize(static_cast<std::size_t>(bodies.size()));
  std::iota(order_.begin(), order_.end(), 0);
  int nodes = 0;
  for (int i = 0; i < bodies.size(); ++i) nodes += bodies[i]->m_nodes.size();
  are_small_ = nodes < few_nodes;
  are_independent_ = true;
  if (are_small_ || bodies.size() < 2) return;
  std::atomic<bool> all_own{true};
  for_each([&](int i) {
    if (!has_only_own_nodes(*bodies[i])) all_own.store(false, std::memory_order_relaxed);
  });
  are_independent_ = all_own;
  if (!are_independent_) return;
  std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) {
    return bodies[a]->m_nodes.size() > bodies[b]->m_nodes.size();
  });
}

void SideBySide::for_each(const std::function<void(int)>& visit) const {
  if (are_small_ || !are_independent_ || order_.size() < 2) {
    for (const int body : order_) visit(body);
    return;
  }
  // With at most three tasks, parallel_for() wakes no sleeping threads.
  const std::size_t tasks = std::max<std::size_t>(order_.size(), 4);
  for_ranges(parallel_for_, tasks, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < std::min(last, order_.size()); ++i) visit(order_[i]);
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
