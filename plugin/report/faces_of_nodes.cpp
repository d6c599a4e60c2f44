#include "report/faces_of_nodes.h"

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

FacesOfNodes::FacesOfNodes(btSoftBody& body)
    : body_(body), first_(static_cast<std::size_t>(body.m_nodes.size()) + 1) {
  const auto for_each_corner = [&](const auto& visit) {
    for (int f = 0; f < body.m_faces.size(); ++f)
      for (const btSoftBody::Node* const node : body.m_faces[f].m_n) visit(index_of(node), f);
  };
  for_each_corner([this](std::size_t node, int) { ++first_[node + 1]; });
  for (std::size_t n = 1; n < first_.size(); ++n) first_[n] += first_[n - 1];
  faces_.resize(first_.back());
  ScratchVector<std::size_t> next(first_.begin(), first_.end() - 1);
  for_each_corner([&](std::size_t node, int face) { faces_[next[node]++] = face; });
}

btSoftBody::Face* FacesOfNodes::find(const btSoftBody::Node* first,
                                     const btSoftBody::Node* second) const {
  const std::size_t node = index_of(first);
  for (std::size_t i = first_[node]; i < first_[node + 1]; ++i) {
    btSoftBody::Face& face = body_.m_faces[faces_[i]];
    const auto last = face.m_n + 3;
    if (second == nullptr || std::find(face.m_n + 0, last, second) != last) return &face;
  }
  return nullptr;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
