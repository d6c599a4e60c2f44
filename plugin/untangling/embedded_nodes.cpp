#include "untangling/embedded_nodes.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <type_traits>

#include "shapes/enclosing_mesh.h"
#include "untangling/face_geometry.h"
#include "untangling/intersections.h"
#include "untangling/penetrations.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

btVector3 place_of(std::int32_t vertex, std::int32_t obstacle, const Motion& motion) {
  return motion.rigid_of(obstacle).start.invXform(to_bullet(motion.start_of(vertex)));
}

template <class A, class B>
bool are_apart(const A& a, const B& b, const Motion& motion) {
  Eigen::AlignedBox3d box_a, box_b;
  for (const std::int32_t v : a) box_a.extend(motion.start_of(v));
  for (const std::int32_t v : b) box_b.extend(motion.start_of(v));
  return !box_a.intersects(box_b);
}

// True if a side of `a`, which is an edge or a face, passes through the face.
template <class A>
bool passes_through(const A& a, const Face& face, const Motion& motion) {
  const std::size_t sides = a.size() == 2 ? 1 : a.size();
  for (std::size_t i = 0; i < sides; ++i) {
    if (edge_intersects_face(motion.start_of(a[i]), motion.start_of(a[(i + 1) % a.size()]),
                             motion.start_of(face[0]), motion.start_of(face[1]),
                             motion.start_of(face[2])))
      return true;
  }
  return false;
}

// True if an edge or a face of the vertex and the obstacle pass through each other.
bool crosses(std::int32_t v, std::int32_t obstacle, const StepTopology& topology,
             const Motion& motion) {
  const Topology view = topology.topology();
  const StepTopology::BodyRecord& soft = topology.bodies()[topology.body_of(v)];
  const IndexRange obstacle_faces = topology.bodies()[obstacle].faces;
  const auto cross = [&](const auto& primitive) {
    if (std::find(primitive.begin(), primitive.end(), v) == primitive.end()) return false;
    for (std::int32_t f = obstacle_faces.first; f < obstacle_faces.last; ++f) {
      const Face& face = view.faces[f];
      if (are_apart(primitive, face, motion)) continue;
      if (passes_through(primitive, face, motion)) return true;
      if constexpr (std::tuple_size<std::decay_t<decltype(primitive)>>::value == 3) {
        if (passes_through(face, primitive, motion)) return true;
      }
    }
    return false;
  };
  return std::any_of(view.faces.begin() + soft.faces.first, view.faces.begin() + soft.faces.last,
                     cross) ||
         std::any_of(view.edges.begin() + soft.edges.first, view.edges.begin() + soft.edges.last,
                     cross);
}

}  // namespace

void EmbeddedNodes::set_topology(const StepTopology& topology, bool keep_absent) {
  if (entries_.empty()) return;
  const std::vector<int> ids = topology.ids();
  std::map<int, std::int32_t> bodies;
  for (std::size_t i = 0; i < ids.size(); ++i) bodies[ids[i]] = static_cast<std::int32_t>(i);
  for (Entry& entry : entries_) {
    const auto soft = bodies.find(entry.soft_id), obstacle = bodies.find(entry.obstacle_id);
    const bool takes_part = soft != bodies.end() && obstacle != bodies.end();
    entry.v = takes_part ? topology.bodies()[soft->second].first_vertex + entry.vertex : -1;
    entry.obstacle = takes_part ? obstacle->second : -1;
  }
  if (!keep_absent) {
    entries_.erase(std::remove_if(entries_.begin(), entries_.end(),
                                  [](const Entry& entry) { return entry.v < 0; }),
                   entries_.end());
  }
  find_pairs();
}

void EmbeddedNodes::find(
    const StepTopology& topology, const Motion& motion, const std::vector<std::int32_t>& placed,
    const std::function<bool(std::int32_t soft_body, std::int32_t obstacle)>& collide) {
  const std::vector<int> ids = topology.ids();
  std::set<int> placed_ids;
  for (const std::int32_t body : placed) placed_ids.insert(ids[body]);
  entries_.erase(std::remove_if(entries_.begin(), entries_.end(),
                                [&](const Entry& entry) {
                                  return placed_ids.count(entry.soft_id) > 0 ||
                                         placed_ids.count(entry.obstacle_id) > 0;
                                }),
                 entries_.end());
  const auto is_placed = [&](std::int32_t body) { return placed_ids.count(ids[body]) > 0; };
  const Pairs found =
      find_pinned_inside(topology, motion, [&](std::int32_t body, std::int32_t obstacle) {
        return (is_placed(body) || is_placed(obstacle)) && collide(body, obstacle);
      });
  for (const auto& [v, obstacle] : found) {
    const std::int32_t body = topology.body_of(v);
    entries_.push_back({ids[body], ids[obstacle], v - topology.bodies()[body].first_vertex,
                        place_of(v, obstacle, motion), v, obstacle});
  }
  find_pairs();
}

bool EmbeddedNodes::forget_left(const StepTopology& topology, const Motion& motion) {
  if (entries_.empty()) return false;
  find_outside(topology, motion);
  const auto has_left = [&](const Entry& entry) {
    return entry.v >= 0 &&
           (motion.is_movable(entry.v) || motion.rigid_of(entry.obstacle).is_movable() ||
            (entry.is_outside && !crosses(entry.v, entry.obstacle, topology, motion)));
  };
  const auto left = std::remove_if(entries_.begin(), entries_.end(), has_left);
  if (left == entries_.end()) return false;
  entries_.erase(left, entries_.end());
  find_pairs();
  return true;
}

void EmbeddedNodes::find_outside(const StepTopology& topology, const Motion& motion) {
  std::set<std::array<std::int32_t, 2>> bodies;  // of the nodes that moved
  std::vector<Entry*> moved;
  for (Entry& entry : entries_) {
    if (entry.v < 0) continue;
    const btVector3 place = place_of(entry.v, entry.obstacle, motion);
    const double rounding = 4 * rounding_at(motion.start_of(entry.v));
    if (static_cast<double>(place.distance(entry.place)) <= rounding) continue;
    entry.place = place;
    // Of a mesh perhaps only the triangles near the soft bodies are known now, and they are open.
    const btCollisionObject& object = *topology.bodies()[entry.obstacle].object;
    entry.is_outside = !may_be_inside_mesh(*object.getCollisionShape(), place);
    if (!entry.is_outside) continue;
    moved.push_back(&entry);
    bodies.insert({topology.body_of(entry.v), entry.obstacle});
  }
  if (moved.empty()) return;
  const Pairs inside =
      find_pinned_inside(topology, motion, [&](std::int32_t body, std::int32_t obstacle) {
        return bodies.count({body, obstacle}) > 0;
      });
  for (Entry* const entry : moved) {
    const std::array<std::int32_t, 2> pair = {entry->v, entry->obstacle};
    entry->is_outside = !std::binary_search(inside.begin(), inside.end(), pair);
  }
}

void EmbeddedNodes::find_pairs() {
  pairs_.clear();
  for (const Entry& entry : entries_)
    if (entry.v >= 0) pairs_.push_back({entry.v, entry.obstacle});
  std::sort(pairs_.begin(), pairs_.end());
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
