#include "scene/step_topology.h"

#include <algorithm>
#include <utility>

#include "scene/collision_filters.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool StepTopology::update(const SoftScene& soft, const Obstacles& obstacles, bool scene_changed) {
  const auto has_filter = [](const SoftScene::BodyRecord& record) {
    return overlap_filter(*record.body) != nullptr;
  };
  // The answers of an application's filter may change at any time.
  const bool filtered_by_application =
      std::any_of(soft.bodies().begin(), soft.bodies().end(), has_filter);
  const bool was_filtered = std::exchange(filtered_by_application_, filtered_by_application);
  if (!scene_changed && !filtered_by_application && !was_filtered &&
      !soft.refused_pairs().is_changed())
    return false;
  const std::vector<BodyPair> disabled_before = std::move(topology_.disabled_pairs);
  const std::vector<Body> filters_before = topology_.bodies;
  if (scene_changed) {
    read_bodies(soft, obstacles);
    topology_ = soft.topology();
    soft_count_ = soft.vertex_count();
    append_obstacles(obstacles);
    free_pinned_nodes();
  }
  topology_.bodies = filters(soft, filtered_by_application);
  topology_.disabled_pairs = disabled_pairs(soft);
  find_largest_margins(soft);
  return scene_changed || topology_.disabled_pairs != disabled_before ||
         !std::equal(filters_before.begin(), filters_before.end(), topology_.bodies.begin(),
                     topology_.bodies.end(), are_equal_filters);
}

Topology StepTopology::for_detection() const {
  Topology topology = topology_.view();
  topology.inverse_mass = inverse_mass_for_detection_;
  return topology;
}

std::vector<int> StepTopology::ids() const {
  std::vector<int> ids;
  for (const BodyRecord& body : bodies_) {
    const btBroadphaseProxy* const proxy = body.object->getBroadphaseHandle();
    ids.push_back(proxy ? proxy->m_uniqueId : -1 - static_cast<int>(ids.size()));
  }
  return ids;
}

void StepTopology::free_pinned_nodes() {
  inverse_mass_for_detection_ = topology_.inverse_mass;
  for (const BodyRecord& body : bodies_) {
    const auto first = inverse_mass_for_detection_.begin() + body.first_vertex;
    const auto last = first + body.vertex_count;
    if (body.soft && std::any_of(first, last, [](float m) { return m > 0; }))
      std::fill(first, last, 1.0f);
  }
}

void StepTopology::append_obstacles(const Obstacles& obstacles) {
  for (Face face : obstacles.faces()) {
    for (std::int32_t& corner : face) corner += soft_count_;
    topology_.faces.push_back(face);
  }
  for (std::size_t body = 0; body < bodies_.size(); ++body) {
    if (bodies_[body].soft) continue;
    const std::size_t count = static_cast<std::size_t>(bodies_[body].vertex_count);
    topology_.body_of_vertex.insert(topology_.body_of_vertex.end(), count,
                                    static_cast<std::int32_t>(body));
    topology_.inverse_mass.insert(topology_.inverse_mass.end(), count,
                                  bodies_[body].dynamic ? 1.0f : 0.0f);
  }
}

std::vector<Body> StepTopology::filters(const SoftScene& soft, bool filtered_by_application) const {
  std::vector<Body> all = soft.topology().bodies;
  while (all.size() < surface_count_) {
    const BodyRecord& record = bodies_[all.size()];
    Body filter;
    filter.self_collision = false;
    CollisionFlags::layers_of(*record.object).set(filter);
    if (!filtered_by_application) {
      const btBroadphaseProxy* proxy = record.object->getBroadphaseHandle();
      filter.group = static_cast<std::uint32_t>(proxy->m_collisionFilterGroup);
      filter.mask = static_cast<std::uint32_t>(proxy->m_collisionFilterMask);
    }
    all.push_back(filter);
  }
  return all;
}

void StepTopology::read_bodies(const SoftScene& soft, const Obstacles& obstacles) {
  bodies_.clear();
  for (const SoftScene::BodyRecord& record : soft.bodies()) {
    bodies_.push_back({record.body, record.body, -1, false, record.first_vertex,
                       record.vertex_count, static_cast<double>(record.margin), record.responds,
                       record.faces, record.edges, nullptr});
  }
  const std::vector<Obstacles::Record>& records = obstacles.records();
  auto first_face = static_cast<std::int32_t>(soft.topology().faces.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Obstacles::Record& record = records[i];
    if (record.vertex_count == 0) continue;
    const IndexRange faces = {
        first_face, first_face + static_cast<std::int32_t>(record.triangles->faces.size())};
    bodies_.push_back({record.object, nullptr, static_cast<int>(i), record.dynamic,
                       soft.vertex_count() + record.first_vertex, record.vertex_count,
                       margin_of_triangles(*record.shape), true, faces, IndexRange(),
                       record.triangles});
    first_face = faces.last;
  }
  surface_count_ = bodies_.size();
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (records[i].vertex_count > 0 || !records[i].has_anchored_nodes) continue;
    bodies_.push_back({records[i].object, nullptr, static_cast<int>(i), true,
                       soft.vertex_count() + obstacles.vertex_count(), 0, 0, true, IndexRange(),
                       IndexRange(), nullptr});
  }
}

std::vector<BodyPair> StepTopology::disabled_pairs(const SoftScene& soft) const {
  std::vector<BodyPair> pairs = soft.topology().disabled_pairs;
  const std::size_t soft_bodies = soft.bodies().size();
  for (std::size_t a = 0; a < soft_bodies; ++a) {
    for (std::size_t b = soft_bodies; b < surface_count_; ++b) {
      if (!may_collide(*bodies_[a].soft, *bodies_[b].object) ||
          soft.refused_pairs().contains(*bodies_[a].soft, *bodies_[b].object))
        pairs.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
    }
  }
  return pairs;
}

void StepTopology::find_largest_margins(const SoftScene& soft) {
  std::vector<BodyPair> disabled = topology_.disabled_pairs;
  std::sort(disabled.begin(), disabled.end());
  largest_margins_ = 0;
  const auto count = static_cast<std::int32_t>(surface_count_);
  for (std::int32_t a = 0; a < static_cast<std::int32_t>(soft.bodies().size()); ++a) {
    const Body& filter = topology_.bodies[a];
    // Counts the sum with an obstacle even if none is near: most have no margin around their
    // triangles.
    if (soft.bodies()[a].meets_rigid)
      largest_margins_ = std::max(largest_margins_, bodies_[a].margin);
    for (std::int32_t b = a; b < count; ++b) {
      const double margins = bodies_[a].margin + bodies_[b].margin;
      if (!(margins > largest_margins_)) continue;
      const Body& other = topology_.bodies[b];
      const bool meet =
          a == b ? filter.self_collision
                 : filters_accept(filter, other) &&
                       !std::binary_search(disabled.begin(), disabled.end(), BodyPair{a, b});
      if (meet) largest_margins_ = margins;
    }
  }
}

std::int32_t first_side_index(const Topology& topology) {
  return static_cast<std::int32_t>(3 * topology.faces.size() + topology.edges.size());
}

std::int32_t first_edge_index(const Topology& topology) {
  return first_side_index(topology) + static_cast<std::int32_t>(3 * topology.faces.size());
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
