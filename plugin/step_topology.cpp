#include "step_topology.h"

#include <algorithm>

#include "pair_rules.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool StepTopology::update(const SoftScene& soft, const Obstacles& obstacles, bool parts_changed) {
  if (parts_changed) {
    read_bodies(soft, obstacles);
    const Topology part = soft.topology();
    soft_count_ = static_cast<std::int32_t>(part.vertex_count);
    faces_.assign(part.faces.begin(), part.faces.end());
    edges_.assign(part.edges.begin(), part.edges.end());
    body_of_vertex_.assign(part.body_of_vertex.begin(), part.body_of_vertex.end());
    inverse_mass_.assign(part.inverse_mass.begin(), part.inverse_mass.end());
    for (Face face : obstacles.faces()) {
      for (std::int32_t& corner : face) corner += soft_count_;
      faces_.push_back(face);
    }
    for (std::size_t body = soft.bodies().size(); body < bodies_.size(); ++body) {
      const std::size_t count = static_cast<std::size_t>(bodies_[body].vertex_count);
      body_of_vertex_.insert(body_of_vertex_.end(), count, static_cast<std::int32_t>(body));
      inverse_mass_.insert(inverse_mass_.end(), count, bodies_[body].dynamic ? 1.0f : 0.0f);
    }
  }
  const Topology part = soft.topology();
  filters_.assign(part.bodies.begin(), part.bodies.end());
  bool filtered_by_application = false;
  for (const SoftScene::BodyRecord& record : soft.bodies()) {
    filtered_by_application = filtered_by_application || overlap_filter(*record.body) != nullptr;
  }
  for (const BodyRecord& record : bodies_) {
    if (record.soft) continue;
    Body filter;
    filter.self_collision = false;
    if (!filtered_by_application) {
      const btBroadphaseProxy* proxy = record.object->getBroadphaseHandle();
      filter.group = static_cast<std::uint32_t>(proxy->m_collisionFilterGroup);
      filter.mask = static_cast<std::uint32_t>(proxy->m_collisionFilterMask);
    }
    filters_.push_back(filter);
  }
  // An application's own filter may change its mind at any time.
  if (!parts_changed && !filtered_by_application) return false;
  std::vector<BodyPair> disabled = disabled_pairs(soft);
  const bool same = !parts_changed && disabled == disabled_pairs_;
  disabled_pairs_ = std::move(disabled);
  return !same;
}

void StepTopology::read_bodies(const SoftScene& soft, const Obstacles& obstacles) {
  bodies_.clear();
  for (const SoftScene::BodyRecord& record : soft.bodies()) {
    bodies_.push_back({record.body, record.body, -1, false, record.first_vertex,
                       record.vertex_count, static_cast<double>(record.margin), record.responds});
  }
  for (std::size_t i = 0; i < obstacles.records().size(); ++i) {
    const Obstacles::Record& record = obstacles.records()[i];
    if (record.vertex_count == 0) continue;
    bodies_.push_back({record.object, nullptr, static_cast<int>(i), record.dynamic,
                       soft.vertex_count() + record.first_vertex, record.vertex_count,
                       margin_of_triangles(*record.shape), true});
  }
}

std::vector<BodyPair> StepTopology::disabled_pairs(const SoftScene& soft) const {
  const Topology part = soft.topology();
  std::vector<BodyPair> pairs(part.disabled_pairs.begin(), part.disabled_pairs.end());
  const std::size_t soft_bodies = soft.bodies().size();
  for (std::size_t a = 0; a < soft_bodies; ++a) {
    for (std::size_t b = soft_bodies; b < bodies_.size(); ++b) {
      if (!Obstacles::meets_obstacles(*bodies_[a].soft) ||
          !may_collide(*bodies_[a].soft, *bodies_[b].object)) {
        pairs.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
      }
    }
  }
  // Rigid bodies among themselves are Bullet's.
  for (std::size_t a = soft_bodies; a < bodies_.size(); ++a) {
    for (std::size_t b = a + 1; b < bodies_.size(); ++b) {
      if (!bodies_[a].dynamic && !bodies_[b].dynamic) continue;
      pairs.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
    }
  }
  return pairs;
}

Topology StepTopology::topology() const {
  Topology t;
  t.vertex_count = body_of_vertex_.size();
  t.faces = faces_;
  t.edges = edges_;
  t.body_of_vertex = body_of_vertex_;
  t.inverse_mass = inverse_mass_;
  t.bodies = filters_;
  t.disabled_pairs = disabled_pairs_;
  return t;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
