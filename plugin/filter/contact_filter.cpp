#include "filter/contact_filter.h"

#include <algorithm>
#include <array>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void ContactFilter::set_topology() {
  seams_.update(scene_, motion_);
  find_closed_seams();
}

void ContactFilter::begin_motion() {
  stage_ = Stage::prediction;
  find_closed_seams();
}

void ContactFilter::find_closed_seams() {
  seams_.find_closed(scene_, motion_, [this](std::int32_t body) {
    return settings::detection::closed_seam * surfaces_.of(body, body).thickness;
  });
}

ContactFilter::Verdict ContactFilter::verdict(const Contact& contact) const {
  if (is_joined(contact)) return Verdict::ignore;
  if (!bodies_respond(contact) || !has_response(contact)) return Verdict::report_only;
  if (untangling_.allows_any_pass() && untangling_.allows_pass(contact, motion_))
    return Verdict::pass;
  const bool rest = !at_rest_.empty() && at_rest_[static_cast<std::size_t>(contact.body_a)] &&
                    at_rest_[static_cast<std::size_t>(contact.body_b)];
  return rest ? Verdict::rest : Verdict::act;
}

bool ContactFilter::is_joined(const Contact& contact) const {
  const std::int32_t* const vertices = contact.vertices.data();
  if (are_anchored(contact.body_a, contact.body_b, {vertices, 4}, embedded_)) return true;
  const auto of_a = static_cast<std::size_t>(first_vertex_of_b(contact.kind));
  return contact.body_a == contact.body_b &&
         seams_.meet({vertices, of_a}, {vertices + of_a, 4 - of_a});
}

bool ContactFilter::has_response(const Contact& contact) const {
  const auto& vertices = contact.vertices;
  if (std::any_of(vertices.begin(), vertices.end(),
                  [this](std::int32_t v) { return is_movable(v); }))
    return true;
  const bool end_changed = stage_ != Stage::prediction;
  bool nodes_move = false, body_moves = false, was_stopped = false;
  for (const std::int32_t v : vertices) {
    const Vector3d end = motion_.end_of(v), predicted = end_changed ? motion_.predicted[v] : end;
    if (predicted != motion_.start_of(v)) (topology_.is_soft(v) ? nodes_move : body_moves) = true;
    was_stopped |= stage_ == Stage::response && end != predicted;
  }
  return (nodes_move && !body_moves) || was_stopped;
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
  anchors_.add_held(scene_.bodies()[soft_body], topology_.bodies()[obstacle].object, vertices);
  for (const auto& [v, body] : embedded_.vertices)
    if (body == obstacle && topology_.body_of(v) == soft_body) vertices.push_back(v);
  std::sort(vertices.begin(), vertices.end());
}

bool ContactFilter::are_anchored(std::int32_t body_a, std::int32_t body_b,
                                 Span<const std::int32_t> vertices,
                                 const PartsInside& embedded) const {
  if (anchors_.empty() && embedded.empty()) return false;
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
  return std::any_of(vertices.begin(), vertices.end(), [&](std::int32_t v) {
    return topology_.is_soft(v) && anchors_.hold(v, object);
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
