#include "contact/contact_filter.h"

#include <algorithm>
#include <array>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void ContactFilter::read_anchors() {
  anchors_.clear();
  for (const SoftScene::BodyRecord& record : scene_.bodies()) {
    const btSoftBody& soft = *record.body;
    const auto add = [&](const btSoftBody::Node* node, const btCollisionObject* object) {
      const std::int32_t v = scene_.vertex_of(record, static_cast<int>(node - &soft.m_nodes[0]));
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

std::size_t ContactFilter::first_anchor(std::int32_t vertex) const {
  const auto is_before = [](const Anchor& anchor, std::int32_t v) { return anchor.vertex < v; };
  const auto first = std::lower_bound(anchors_.begin(), anchors_.end(), vertex, is_before);
  return static_cast<std::size_t>(first - anchors_.begin());
}

bool ContactFilter::holds(std::int32_t soft_vertex, const btCollisionObject* object) const {
  for (std::size_t i = first_anchor(soft_vertex);
       i < anchors_.size() && anchors_[i].vertex == soft_vertex; ++i)
    if (anchors_[i].object == object) return true;
  return false;
}

void ContactFilter::set_topology() {
  seams_.update(scene_, motion_);
  find_closed_seams();
}

void ContactFilter::begin_motion() {
  end_changed_ = false;
  find_closed_seams();
}

void ContactFilter::find_closed_seams() {
  seams_.find_closed(scene_, motion_, [this](std::int32_t body) {
    return settings::detection::closed_seam * surfaces_.of(body, body).thickness;
  });
}

ContactFilter::Decision ContactFilter::decide(const Contact& contact) const {
  const std::int32_t* const vertices = contact.vertices.data();
  const auto of_a = static_cast<std::size_t>(first_vertex_of_b(contact.kind));
  if (is_anchored(contact) || (contact.body_a == contact.body_b &&
                               seams_.meet({vertices, of_a}, {vertices + of_a, 4 - of_a})))
    return Decision::ignore;
  return bodies_respond(contact) && has_response(contact) ? Decision::respond
                                                          : Decision::report_only;
}

bool ContactFilter::has_response(const Contact& contact) const {
  const auto was_stopped = [this](std::int32_t v) {
    return end_changed_ && motion_.end_of(v) != motion_.predicted[v];
  };
  return has_response_as_predicted(contact) ||
         std::any_of(contact.vertices.begin(), contact.vertices.end(), was_stopped);
}

bool ContactFilter::has_response_as_predicted(const Contact& contact) const {
  if (std::any_of(contact.vertices.begin(), contact.vertices.end(),
                  [this](std::int32_t v) { return is_movable(v); }))
    return true;
  bool nodes_move = false, body_moves = false;
  for (const std::int32_t v : contact.vertices) {
    const Vector3d end = end_changed_ ? motion_.predicted[v] : motion_.end_of(v);
    if (end != motion_.start_of(v)) (topology_.is_soft(v) ? nodes_move : body_moves) = true;
  }
  return nodes_move && !body_moves;
}

bool ContactFilter::is_movable(std::int32_t v) const {
  return topology_.is_soft(v) ? motion_.is_free(v) || motion_.anchor_body_of(v) >= 0
                              : motion_.rigid_of(topology_.body_of(v)).is_movable();
}

bool ContactFilter::bodies_respond(const Contact& contact) const {
  return topology_.bodies()[contact.body_a].responds && topology_.bodies()[contact.body_b].responds;
}

bool ContactFilter::ignores(const Edge& edge, const Face& face) const {
  const std::int32_t body_a = topology_.body_of(edge[0]), body_b = topology_.body_of(face[0]);
  if (body_a == body_b) return seams_.meet({edge.data(), edge.size()}, {face.data(), face.size()});
  const std::array<std::int32_t, 5> vertices = {edge[0], edge[1], face[0], face[1], face[2]};
  return are_anchored(body_a, body_b, {vertices.data(), vertices.size()}, pinned_);
}

void ContactFilter::find_anchored(std::int32_t soft_body, std::int32_t obstacle,
                                  std::vector<std::int32_t>& vertices) const {
  vertices.clear();
  const btCollisionObject* const object = topology_.bodies()[obstacle].object;
  const SoftScene::BodyRecord& record = scene_.bodies()[soft_body];
  const std::size_t last = first_anchor(record.first_vertex + record.vertex_count);
  for (std::size_t i = first_anchor(record.first_vertex); i < last; ++i)
    if (anchors_[i].object == object) vertices.push_back(anchors_[i].vertex);
  for (const auto& [v, body] : embedded_.vertices)
    if (body == obstacle && topology_.body_of(v) == soft_body) vertices.push_back(v);
  std::sort(vertices.begin(), vertices.end());
}

bool ContactFilter::are_anchored(std::int32_t body_a, std::int32_t body_b,
                                 Span<const std::int32_t> vertices,
                                 const PartsInside& embedded) const {
  const StepTopology::BodyRecord& a = topology_.bodies()[body_a];
  const StepTopology::BodyRecord& b = topology_.bodies()[body_b];
  if (a.soft && b.soft) return false;
  const std::int32_t obstacle_index = a.soft ? body_b : body_a;
  if (!embedded.empty()) {
    std::array<std::int32_t, 5> of_soft;
    std::size_t count = 0;
    for (const std::int32_t v : vertices)
      if (topology_.is_soft(v)) of_soft[count++] = v;
    if (embedded.contains({of_soft.data(), count}, obstacle_index)) return true;
  }
  const btCollisionObject* const object = topology_.bodies()[obstacle_index].object;
  return std::any_of(vertices.begin(), vertices.end(),
                     [&](std::int32_t v) { return topology_.is_soft(v) && holds(v, object); });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
