#include "bodies/normals.h"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "util/scratch_vector.h"
#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr std::size_t grain = 2048;  // work that takes longer than waking a thread

// Several lists one after the other: list i begins at firsts[i]. Calls visit(i, first, last) for
// the part of each list that is in [begin, end); `first` and `last` count from the list's begin.
template <class Visit>
void for_parts(Span<const std::size_t> firsts, std::size_t begin, std::size_t end,
               const Visit& visit) {
  for (std::size_t i = 0; i + 1 < firsts.size(); ++i) {
    const std::size_t first = std::max(begin, firsts[i]), last = std::min(end, firsts[i + 1]);
    if (first < last) visit(i, first - firsts[i], last - firsts[i]);
  }
}

}  // namespace

bool Normals::Plan::fits(const btSoftBody& other) const {
  return body == &other && static_cast<std::size_t>(other.m_faces.size()) == normals.size() &&
         static_cast<std::size_t>(other.m_nodes.size()) + 1 == first_face.size();
}

bool Normals::plan(const btSoftBody& body, Plan& plan) {
  plan.body = nullptr;
  const auto nodes = static_cast<std::size_t>(body.m_nodes.size());
  plan.corners.clear();
  plan.first_face.assign(nodes + 1, 0);
  for (int i = 0; i < body.m_faces.size(); ++i) {
    for (const btSoftBody::Node* corner : body.m_faces[i].m_n) {
      const int node = index_of(body, corner);
      if (node < 0) return false;
      plan.corners.push_back(node);
      ++plan.first_face[static_cast<std::size_t>(node) + 1];
    }
  }
  std::partial_sum(plan.first_face.begin(), plan.first_face.end(), plan.first_face.begin());
  std::vector<std::int32_t> next = plan.first_face;
  plan.faces.resize(plan.corners.size());
  for (std::size_t i = 0; i < plan.corners.size(); ++i) {
    std::int32_t& place = next[static_cast<std::size_t>(plan.corners[i])];
    plan.faces[static_cast<std::size_t>(place++)] = static_cast<std::int32_t>(i / 3);
  }
  plan.normals.resize(static_cast<std::size_t>(body.m_faces.size()));
  plan.body = &body;
  return true;
}

void Normals::update(const btAlignedObjectArray<btSoftBody*>& bodies,
                     const ParallelFor& parallel_for) {
  bodies_.clear();
  for (int i = 0; i < bodies.size(); ++i)
    if (bodies[i]->isActive()) bodies_.push_back(bodies[i]);
  plans_.resize(std::max(plans_.size(), bodies_.size()));
  bool all_planned = true;
  for (std::size_t i = 0; i < bodies_.size() && all_planned; ++i)
    all_planned = plans_[i].fits(*bodies_[i]) || plan(*bodies_[i], plans_[i]);
  if (all_planned && update_faces(parallel_for)) return update_nodes(parallel_for);
  for (Plan& plan : plans_) plan.body = nullptr;
  for (btSoftBody* body : bodies_) body->updateNormals();
}

bool Normals::update_faces(const ParallelFor& parallel_for) {
  ScratchVector<std::size_t> firsts(1, 0);
  for (const btSoftBody* body : bodies_)
    firsts.push_back(firsts.back() + static_cast<std::size_t>(body->m_faces.size()));
  std::atomic<bool> all_fit{true};
  for_ranges(parallel_for, firsts.back(), grain, [&](std::size_t begin, std::size_t end) {
    for_parts(firsts, begin, end, [&](std::size_t i, std::size_t first, std::size_t last) {
      if (!update_faces(*bodies_[i], plans_[i], first, last))
        all_fit.store(false, std::memory_order_relaxed);
    });
  });
  return all_fit;
}

bool Normals::update_faces(btSoftBody& body, Plan& plan, std::size_t first, std::size_t last) {
  if (body.m_nodes.size() == 0) return true;
  const btSoftBody::Node* const nodes = &body.m_nodes[0];
  for (std::size_t i = first; i < last; ++i) {
    btSoftBody::Face& face = body.m_faces[static_cast<int>(i)];
    for (std::size_t k = 0; k < 3; ++k)
      if (face.m_n[k] != nodes + plan.corners[3 * i + k]) return false;
    const btVector3 normal =
        btCross(face.m_n[1]->m_x - face.m_n[0]->m_x, face.m_n[2]->m_x - face.m_n[0]->m_x);
    plan.normals[i] = face.m_normal = normal;
    face.m_normal.safeNormalize();
  }
  return true;
}

void Normals::update_nodes(const ParallelFor& parallel_for) {
  ScratchVector<std::size_t> firsts(1, 0);
  for (const btSoftBody* body : bodies_)
    firsts.push_back(firsts.back() + static_cast<std::size_t>(body->m_nodes.size()));
  for_ranges(parallel_for, firsts.back(), grain, [&](std::size_t begin, std::size_t end) {
    for_parts(firsts, begin, end, [&](std::size_t i, std::size_t first, std::size_t last) {
      const Plan& plan = plans_[i];
      for (std::size_t node = first; node < last; ++node) {
        btVector3 normal(0, 0, 0);
        const std::int32_t* const faces = plan.faces.data();
        for (std::int32_t f = plan.first_face[node]; f < plan.first_face[node + 1]; ++f)
          normal += plan.normals[static_cast<std::size_t>(faces[f])];
        const btScalar length = normal.length();
        if (length > SIMD_EPSILON) normal /= length;
        bodies_[i]->m_nodes[static_cast<int>(node)].m_n = normal;
      }
    });
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
