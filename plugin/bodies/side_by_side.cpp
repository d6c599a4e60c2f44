#include "bodies/side_by_side.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <numeric>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

template <class Elements>
bool are_own(const btSoftBody& body, const Elements& elements) {
  const btSoftBody::Node* const first = body.m_nodes.size() > 0 ? &body.m_nodes[0] : nullptr;
  const btSoftBody::Node* const last = first + body.m_nodes.size();
  bool own = true;
  for (int i = 0; i < elements.size(); ++i)
    for (const btSoftBody::Node* node : elements[i].m_n)
      own &= !std::less<>()(node, first) && std::less<>()(node, last);
  return own;
}

}  // namespace

bool has_own_faces(const btSoftBody& body) { return are_own(body, body.m_faces); }
bool has_own_links(const btSoftBody& body) { return are_own(body, body.m_links); }
bool has_own_tetrahedra(const btSoftBody& body) { return are_own(body, body.m_tetras); }

void SideBySide::begin(const Bodies& bodies, bool (*is_alone)(const btSoftBody& body)) {
  constexpr int few_nodes = 2048;  // to wake a thread takes longer than to visit these
  order_.resize(static_cast<std::size_t>(bodies.size()));
  std::iota(order_.begin(), order_.end(), 0);
  int nodes = 0;
  for (int i = 0; i < bodies.size(); ++i) nodes += bodies[i]->m_nodes.size();
  is_parallel_ = threads() > 1 && bodies.size() > 1 && nodes >= few_nodes;
  if (!is_parallel_) return;
  std::atomic<bool> all_alone{true};
  for_each([&](int i) {
    if (!is_alone(*bodies[i])) all_alone.store(false, std::memory_order_relaxed);
  });
  is_parallel_ = all_alone;
  if (!is_parallel_) return;
  std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) {
    return bodies[a]->m_nodes.size() > bodies[b]->m_nodes.size();
  });
}

void SideBySide::for_each(FunctionRef<void(int)> visit) const {
  if (!is_parallel_) {
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
