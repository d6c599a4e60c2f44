#include "untangling/embedded_parts.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <type_traits>

#include "shapes/enclosing_mesh.h"
#include "untangling/face_geometry.h"
#include "untangling/intersections.h"
#include "util/box.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

btVector3 place_of(std::int32_t vertex, std::int32_t obstacle, const Motion& motion) {
  return motion.rigid_of(obstacle).start.invXform(to_bullet(motion.start_of(vertex)));
}

// Null if the vertex is not in the list, which is sorted.
const InsideVertex* find_vertex(const std::vector<InsideVertex>& inside, std::int32_t v,
                                std::int32_t body) {
  const InsideVertex vertex = {v, body, 0};
  const auto at = std::lower_bound(inside.begin(), inside.end(), vertex);
  return at == inside.end() || vertex < *at ? nullptr : &*at;
}

template <class A, class B>
bool are_apart(const A& a, const B& b, const Motion& motion) {
  Box3d box_a, box_b;
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

// True if the edge or face of a soft body and the obstacle pass through each other.
template <class Primitive>
bool crosses(const Primitive& primitive, std::int32_t obstacle, const StepTopology& topology,
             const Motion& motion) {
  const Topology view = topology.topology();
  const IndexRange faces = topology.bodies()[obstacle].faces;
  return std::any_of(view.faces.begin() + faces.first, view.faces.begin() + faces.last,
                     [&](const Face& face) {
                       if (are_apart(primitive, face, motion)) return false;
                       if (passes_through(primitive, face, motion)) return true;
                       if constexpr (std::tuple_size<Primitive>::value == 3)
                         return passes_through(face, primitive, motion);
                       return false;
                     });
}

// True if an edge or a face of the vertex and the obstacle pass through each other.
bool any_crosses(std::int32_t v, std::int32_t obstacle, const StepTopology& topology,
                 const Motion& motion) {
  const Topology view = topology.topology();
  const StepTopology::BodyRecord& soft = topology.bodies()[topology.body_of(v)];
  const auto of_vertex_crosses = [&](const auto& primitive) {
    return std::find(primitive.begin(), primitive.end(), v) != primitive.end() &&
           crosses(primitive, obstacle, topology, motion);
  };
  return std::any_of(view.faces.begin() + soft.faces.first, view.faces.begin() + soft.faces.last,
                     of_vertex_crosses) ||
         std::any_of(view.edges.begin() + soft.edges.first, view.edges.begin() + soft.edges.last,
                     of_vertex_crosses);
}

}  // namespace

void EmbeddedParts::set_topology(const StepTopology& topology, bool keep_absent) {
  if (entries_.empty()) return;
  const std::vector<int> ids = topology.ids();
  std::map<int, std::int32_t> bodies;
  for (std::size_t i = 0; i < ids.size(); ++i) bodies[ids[i]] = static_cast<std::int32_t>(i);
  for (Entry& entry : entries_) {
    const auto soft = bodies.find(entry.soft_id), obstacle = bodies.find(entry.obstacle_id);
    const bool takes_part = soft != bodies.end() && obstacle != bodies.end();
    entry.obstacle = takes_part ? obstacle->second : -1;
    for (std::size_t i = 0; i < entry.count && takes_part; ++i)
      entry.v[i] = topology.bodies()[soft->second].first_vertex + entry.vertices[i];
  }
  if (!keep_absent) {
    entries_.erase(std::remove_if(entries_.begin(), entries_.end(),
                                  [](const Entry& entry) { return entry.obstacle < 0; }),
                   entries_.end());
  }
  find_parts();
}

void EmbeddedParts::add(Span<const std::int32_t> primitive, std::int32_t obstacle, bool is_trapped,
                        double depth, const StepTopology& topology, const std::vector<int>& ids,
                        const Motion& motion) {
  const std::int32_t body = topology.body_of(primitive[0]);
  Entry entry;
  entry.soft_id = ids[body];
  entry.obstacle_id = ids[obstacle];
  entry.count = primitive.size();
  entry.is_trapped = is_trapped;
  entry.depth = depth;
  entry.obstacle = obstacle;
  for (std::size_t i = 0; i < primitive.size(); ++i) {
    entry.v[i] = primitive[i];
    entry.vertices[i] = primitive[i] - topology.bodies()[body].first_vertex;
    entry.places[i] = place_of(primitive[i], obstacle, motion);
  }
  entries_.push_back(entry);
}

void EmbeddedParts::find_pinned(
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
  const std::vector<InsideVertex> found = find_inside(
      topology, motion,
      [&](std::int32_t body, std::int32_t obstacle) {
        return (is_placed(body) || is_placed(obstacle)) && collide(body, obstacle);
      },
      [&](std::int32_t v, std::int32_t obstacle) {
        return !motion.rigid_of(obstacle).is_movable() && !motion.is_movable(v);
      });
  for (const InsideVertex& at : found)
    add({&at.vertex, 1}, at.body, false, at.depth, topology, ids, motion);
  find_parts();
}

bool EmbeddedParts::update_trapped(const StepTopology& topology, const Motion& motion,
                                   const Penetrations& found) {
  const PartsInside& trapped = found.trapped;
  if (entries_.empty() && trapped.empty()) return false;
  const std::vector<int> ids = topology.ids();
  const auto has_way_out = [&](const Entry& entry) {
    return entry.is_trapped && entry.count == 1 && entry.obstacle >= 0 &&
           find_vertex(found.inside, entry.v[0], entry.obstacle) &&
           !trapped.contains(entry.primitive(), entry.obstacle);
  };
  const auto left = std::remove_if(entries_.begin(), entries_.end(), has_way_out);
  bool has_changed = left != entries_.end();
  entries_.erase(left, entries_.end());
  const auto add_new = [&](const auto& list, const auto& known) {
    for (const auto& part : list) {
      if (std::binary_search(known.begin(), known.end(), part)) continue;
      const Span<const std::int32_t> primitive(part.data(), part.size() - 1);
      const InsideVertex* const at =
          part.size() == 2 ? find_vertex(found.inside, part.front(), part.back()) : nullptr;
      add(primitive, part.back(), true, at ? at->depth : 0, topology, ids, motion);
      has_changed = true;
    }
  };
  add_new(trapped.vertices, parts_.vertices);
  add_new(trapped.edges, parts_.edges);
  add_new(trapped.faces, parts_.faces);
  if (has_changed) find_parts();
  return has_changed;
}

bool EmbeddedParts::forget_left(const StepTopology& topology, const Motion& motion) {
  if (entries_.empty()) return false;
  find_outside(topology, motion);
  const auto has_left = [&](const Entry& entry) {
    if (entry.obstacle < 0) return false;
    if (motion.rigid_of(entry.obstacle).is_movable()) return true;
    if (!entry.is_trapped && motion.is_movable(entry.v[0])) return true;
    return entry.is_outside &&
           (entry.count > 1 || !any_crosses(entry.v[0], entry.obstacle, topology, motion));
  };
  const auto left = std::remove_if(entries_.begin(), entries_.end(), has_left);
  if (left == entries_.end()) return false;
  entries_.erase(left, entries_.end());
  find_parts();
  return true;
}

bool EmbeddedParts::has_moved(Entry& entry, const Motion& motion) {
  std::array<btVector3, 3> places;
  bool has_moved = false;
  for (std::size_t i = 0; i < entry.count; ++i) {
    places[i] = place_of(entry.v[i], entry.obstacle, motion);
    const double rounding = 4 * rounding_at(motion.start_of(entry.v[i]));
    has_moved = has_moved || static_cast<double>(places[i].distance(entry.places[i])) >
                                 std::max(rounding, entry.depth - rounding);
  }
  if (has_moved) entry.places = places;
  return has_moved;
}

void EmbeddedParts::find_outside(const StepTopology& topology, const Motion& motion) {
  std::vector<Entry*> moved;
  std::vector<std::array<std::int32_t, 2>> bodies, vertices;  // each with an obstacle
  for (Entry& entry : entries_) {
    if (entry.obstacle < 0 || !has_moved(entry, motion)) continue;
    entry.depth = 0;
    if (entry.count == 2) {
      const Edge edge = {entry.v[0], entry.v[1]};
      entry.is_outside = !crosses(edge, entry.obstacle, topology, motion);
    } else if (entry.count == 3) {
      const Face face = {entry.v[0], entry.v[1], entry.v[2]};
      entry.is_outside = !crosses(face, entry.obstacle, topology, motion);
    } else {
      // Of a mesh perhaps only the triangles near the soft bodies are known now; they are open.
      const btCollisionObject& object = *topology.bodies()[entry.obstacle].object;
      entry.is_outside = !may_be_inside_mesh(*object.getCollisionShape(), entry.places[0]);
      if (!entry.is_outside) continue;
      moved.push_back(&entry);
      bodies.push_back({topology.body_of(entry.v[0]), entry.obstacle});
      vertices.push_back({entry.v[0], entry.obstacle});
    }
  }
  if (moved.empty()) return;
  std::sort(bodies.begin(), bodies.end());
  std::sort(vertices.begin(), vertices.end());
  const auto is_in = [](const auto& pairs, std::int32_t a, std::int32_t b) {
    return std::binary_search(pairs.begin(), pairs.end(), std::array<std::int32_t, 2>{a, b});
  };
  const std::vector<InsideVertex> inside = find_inside(
      topology, motion,
      [&](std::int32_t body, std::int32_t obstacle) { return is_in(bodies, body, obstacle); },
      [&](std::int32_t v, std::int32_t obstacle) { return is_in(vertices, v, obstacle); });
  for (Entry* const entry : moved) {
    const InsideVertex* const at = find_vertex(inside, entry->v[0], entry->obstacle);
    entry->is_outside = !at;
    if (at) entry->depth = at->depth;
  }
}

void EmbeddedParts::find_parts() {
  parts_ = pinned_ = {};
  for (const Entry& entry : entries_) {
    if (entry.obstacle < 0) continue;
    const auto& v = entry.v;
    if (entry.count == 1) parts_.vertices.push_back({v[0], entry.obstacle});
    if (entry.count == 2) parts_.edges.push_back({v[0], v[1], entry.obstacle});
    if (entry.count == 3) parts_.faces.push_back({v[0], v[1], v[2], entry.obstacle});
    if (!entry.is_trapped) pinned_.vertices.push_back({v[0], entry.obstacle});
  }
  parts_.sort();
  pinned_.sort();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
