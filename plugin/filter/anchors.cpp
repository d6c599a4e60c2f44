#include "filter/anchors.h"

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void Anchors::read(const SoftScene& scene) {
  anchors_.clear();
  for (const SoftScene::BodyRecord& record : scene.bodies()) {
    const btSoftBody& soft = *record.body;
    const auto add = [&](const btSoftBody::Node* node, const btCollisionObject* object) {
      const std::int32_t v = scene.vertex_of(record, static_cast<int>(node - &soft.m_nodes[0]));
      if (v >= 0) anchors_.push_back({v, object});
    };
    for (int i = 0; i < soft.m_anchors.size(); ++i)
      add(soft.m_anchors[i].m_node, soft.m_anchors[i].m_body);
    for (int i = 0; i < soft.m_deformableAnchors.size(); ++i)
      add(soft.m_deformableAnchors[i].m_node, soft.m_deformableAnchors[i].m_cti.m_colObj);
  }
  std::sort(anchors_.begin(), anchors_.end(),
            [](const Anchor& a, const Anchor& b) { return a.vertex < b.vertex; });
}

std::size_t Anchors::first_anchor(std::int32_t vertex) const {
  const auto is_before = [](const Anchor& anchor, std::int32_t v) { return anchor.vertex < v; };
  const auto first = std::lower_bound(anchors_.begin(), anchors_.end(), vertex, is_before);
  return static_cast<std::size_t>(first - anchors_.begin());
}

bool Anchors::hold(std::int32_t soft_vertex, const btCollisionObject* object) const {
  for (std::size_t i = first_anchor(soft_vertex);
       i < anchors_.size() && anchors_[i].vertex == soft_vertex; ++i)
    if (anchors_[i].object == object) return true;
  return false;
}

void Anchors::add_held(const SoftScene::BodyRecord& body, const btCollisionObject* object,
                       std::vector<std::int32_t>& vertices) const {
  const std::size_t last = first_anchor(body.first_vertex + body.vertex_count);
  for (std::size_t i = first_anchor(body.first_vertex); i < last; ++i)
    if (anchors_[i].object == object) vertices.push_back(anchors_[i].vertex);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
