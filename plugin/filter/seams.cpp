#include "filter/seams.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "util/disjoint_sets.h"
#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void Seams::update(const SoftScene& scene, const Motion& motion) {
  members_.clear();
  for (const SoftScene::BodyRecord& record : scene.bodies()) {
    Nodes& nodes = nodes_of_[record.body];
    if (nodes.proxy_id != proxy_id(*record.body)) nodes = {proxy_id(*record.body), 0, {}, {}};
    if (nodes.count != record.body->m_nodes.size()) find(scene, record, motion, nodes);
    if (nodes.first.empty()) continue;
    find_sewn(*record.body, nodes);
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v) {
      const std::int32_t node = scene.node_index(v), first = nodes.first[node];
      if (node == first) continue;
      const std::int32_t first_vertex = scene.vertex_of(record, first);
      if (first_vertex >= 0) members_.push_back({v, first_vertex, nodes.is_sewn[first] != 0});
    }
  }
  closed_seam_.assign(members_.empty() ? 0 : static_cast<std::size_t>(scene.vertex_count()), -1);
}

void Seams::find_closed(const SoftScene& scene, const Motion& motion,
                        const ClosedDistance& distance) {
  const auto opens_for_good = [&](const Member& member) {
    const std::int32_t v = member.vertex, body = scene.body_of(v);
    const double apart = (motion.start_of(v) - motion.start_of(member.first)).norm();
    const bool is_closed = apart <= distance(body);
    closed_seam_[v] = is_closed ? member.first : -1;
    closed_seam_[member.first] = member.first;
    if (is_closed || member.is_sewn) return false;
    nodes_of_[scene.bodies()[body].body].first[scene.node_index(v)] = scene.node_index(v);
    return true;
  };
  members_.erase(std::remove_if(members_.begin(), members_.end(), opens_for_good), members_.end());
}

void Seams::find(const SoftScene& scene, const SoftScene::BodyRecord& record, const Motion& motion,
                 Nodes& nodes) {
  nodes.count = record.body->m_nodes.size();
  DisjointSets sets(static_cast<std::size_t>(nodes.count));
  for (std::size_t i = 0; i < nodes.first.size(); ++i)
    sets.join(static_cast<std::int32_t>(i), nodes.first[i]);
  const auto place_of = [&motion](std::int32_t v) {
    const btScalar* const x = &motion.start()[3 * static_cast<std::size_t>(v)];
    return std::array<btScalar, 3>{x[0], x[1], x[2]};
  };
  std::vector<std::int32_t> order(static_cast<std::size_t>(record.vertex_count));
  std::iota(order.begin(), order.end(), record.first_vertex);
  std::sort(order.begin(), order.end(),
            [&](std::int32_t a, std::int32_t b) { return place_of(a) < place_of(b); });
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (place_of(order[i - 1]) == place_of(order[i]))
      sets.join(scene.node_index(order[i - 1]), scene.node_index(order[i]));
  }
  nodes.first.clear();
  if (sets.count() == sets.size()) return;
  for (std::int32_t i = 0; i < nodes.count; ++i) nodes.first.push_back(sets.find(i));
}

void Seams::find_sewn(const btSoftBody& body, Nodes& nodes) {
  nodes.is_sewn.assign(nodes.first.size(), 0);
  const auto sew = [&](const btSoftBody::Node* a, const btSoftBody::Node* b) {
    const int index_a = index_of(body, a), index_b = index_of(body, b);
    if (index_a < 0 || index_b < 0 || nodes.first[index_a] != nodes.first[index_b]) return;
    nodes.is_sewn[nodes.first[index_a]] = 1;
  };
  for (int i = 0; i < body.m_links.size(); ++i) sew(body.m_links[i].m_n[0], body.m_links[i].m_n[1]);
  for (int i = 0; i < body.m_faces.size(); ++i) {
    for (int k = 0; k < 3; ++k) sew(body.m_faces[i].m_n[k], body.m_faces[i].m_n[(k + 1) % 3]);
  }
}

bool Seams::meet(Span<const std::int32_t> vertices_a, Span<const std::int32_t> vertices_b) const {
  if (members_.empty()) return false;
  for (const std::int32_t a : vertices_a) {
    const std::int32_t seam = closed_seam_[a];
    if (seam >= 0 && std::any_of(vertices_b.begin(), vertices_b.end(),
                                 [&](std::int32_t b) { return closed_seam_[b] == seam; }))
      return true;
  }
  return false;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
