#include "untangling/penetrations.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "settings.h"
#include "touching/oriented_surface.h"
#include "untangling/closed_surfaces.h"
#include "untangling/convex_penetrations.h"
#include "untangling/face_grid.h"
#include "untangling/penetration_list.h"
#include "untangling/solids.h"
#include "util/box.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Vertices = std::vector<std::int32_t>;

Edge sorted(const Edge& edge) { return {std::min(edge[0], edge[1]), std::max(edge[0], edge[1])}; }

// Finds the penetrations of one obstacle.
class Finder {
 public:
  Finder(const StepTopology& topology, const Motion& motion, std::int32_t obstacle,
         Penetrations& found)
      : topology_(topology),
        view_(topology.topology()),
        motion_(motion),
        obstacle_(obstacle),
        origin_(motion.rigid_of(obstacle).centre()),
        geometry_(view_, motion),
        found_(view_, motion, obstacle, found) {}

  // Below a terrain, along its up axis.
  void find_below(const Vertices& vertices, const Vector3d& up) {
    const auto across = [&](const Vector3d& x) { return FaceGrid::across(up, x); };
    FaceGrid::Box region;
    for (const std::int32_t v : vertices) region.extend(across(motion_.start_of(v)));
    const FaceGrid grid(geometry_, up, faces(), region);
    for (const std::int32_t v : vertices) {
      const Vector3d x = motion_.start_of(v);
      for (const std::int32_t f : grid.near(x)) {
        if (geometry_.is_degenerate(f)) continue;
        const Side side = geometry_.side_of(f, up);
        if (!is_below(side, x, origin_) || !geometry_.covers(f, up, x)) continue;
        found_.add_inside(v, 0);
        found_.add(v, side);
        break;
      }
    }
  }

  void find_below_plane(const Vertices& vertices, const Intersections& intersections,
                        Span<const Edge> edges, const Vector3d& up) {
    const PartsOfObstacle parts(topology_, obstacle_);
    const std::int32_t face = topology_.bodies()[obstacle_].faces.first;
    Candidates candidates =
        find_passing(parts, intersections, edges)[parts.key_of(view_.faces[face][0])];
    candidates.vertices = vertices;
    find_in_convex(topology_, motion_, candidates, origin_, {geometry_.side_of(face, up)}, found_);
  }

  void find_inside(const Vertices& vertices, const Intersections& intersections,
                   Span<const Edge> edges, const Blocking& blocking) {
    const PartsOfObstacle parts(topology_, obstacle_);
    std::map<std::int32_t, Candidates> passing = find_passing(parts, intersections, edges);
    for (const Solid& solid : find_solids(parts, view_, motion_)) {
      Vertices near;
      for (const std::int32_t v : vertices)
        if (solid.box.contains(motion_.start_of(v))) near.push_back(v);
      Candidates& candidates = passing[solid.key];
      candidates.vertices = near;
      if (near.empty() && candidates.edges.empty() && candidates.pierced.empty()) continue;
      const std::vector<Side> sides = solid.is_single ? convex_sides(solid) : std::vector<Side>();
      if (sides.empty()) {
        find_in_solid(near, solid);
      } else {
        candidates.blocking = blocking;
        find_in_convex(topology_, motion_, candidates, origin_, sides, found_);
      }
    }
  }

 private:
  Vertices faces() const {
    const IndexRange range = topology_.bodies()[obstacle_].faces;
    Vertices faces(static_cast<std::size_t>(range.last - range.first));
    std::iota(faces.begin(), faces.end(), range.first);
    return faces;
  }

  // What passes through faces or edges of each part, by its key.
  std::map<std::int32_t, Candidates> find_passing(const PartsOfObstacle& parts,
                                                  const Intersections& intersections,
                                                  Span<const Edge> edges) const {
    std::map<std::int32_t, Candidates> found;
    for (const Intersection& pair : intersections.pairs) {
      const Edge& edge = edges[pair.edge];
      const Face& face = view_.faces[pair.face];
      if (view_.body_of_vertex[face[0]] == obstacle_)
        found[parts.key_of(face[0])].edges.push_back(sorted(edge));
      if (view_.body_of_vertex[edge[0]] == obstacle_)
        found[parts.key_of(edge[0])].pierced.push_back(pair.face);
    }
    for (auto& entry : found) {
      std::vector<Edge>& list = entry.second.edges;
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    return found;
  }

  // The sides of a convex solid; none if it is not convex.
  std::vector<Side> convex_sides(const Solid& solid) const {
    Vertices corners;
    Vector3d middle = Vector3d::Zero();
    for (const std::int32_t f : solid.faces) {
      const Face& face = view_.faces[f];
      corners.insert(corners.end(), face.begin(), face.end());
      for (int k = 0; k < 3; ++k)
        middle += geometry_.corner(f, k) / (3.0 * static_cast<double>(solid.faces.size()));
    }
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    const double spare = settings::untangling::convex_tolerance * solid.box.diagonal().norm();
    std::vector<Side> sides;
    for (const std::int32_t f : solid.faces) {
      if (geometry_.is_degenerate(f)) continue;
      Side side = geometry_.side_of(f, Vector3d::Zero());
      // Single faces may be oriented inwards.
      if (side.height(middle) > 0) {
        side.normal = -side.normal;
        side.offset = -side.offset;
      }
      const auto is_below = [&](std::int32_t v) {
        return side.height(motion_.start_of(v)) <= spare;
      };
      if (!std::all_of(corners.begin(), corners.end(), is_below)) return {};
      sides.push_back(side);
    }
    return sides;
  }

  // Each vertex leaves through the nearest face.
  void find_in_solid(const Vertices& near, const Solid& solid) {
    if (near.empty()) return;
    int axis;
    solid.box.diagonal().minCoeff(&axis);
    const FaceGrid grid(geometry_, Vector3d::Unit(axis), solid.faces);
    for (const std::int32_t v : near) {
      const Vector3d x = motion_.start_of(v);
      const double winding = solid.is_oriented ? grid.winding_number(x)
                                               : winding_number(view_, motion_, solid.faces, x);
      if (!(winding > settings::untangling::inside_winding)) continue;
      const FaceGrid::Nearest nearest = grid.nearest(x);
      if (nearest.face < 0) continue;
      const Vector3d normal = (nearest.point - x).normalized();
      found_.add_inside(v, (nearest.point - x).norm());
      found_.add(v, {nearest.face, normal, normal.dot(nearest.point)});
    }
  }

  const StepTopology& topology_;
  Topology view_;
  const Motion& motion_;
  std::int32_t obstacle_;
  Vector3d origin_;
  FaceGeometry geometry_;
  PenetrationList found_;
};

// Extent of the box along a direction.
double lower_end(const Box3d& box, const Vector3d& direction) {
  return box.center().dot(direction) - 0.5 * box.diagonal().dot(direction.cwiseAbs());
}

void sort(Penetrations& found) {
  std::stable_sort(found.contacts.begin(), found.contacts.end());
  found.sort();
  found.trapped.sort();
  std::sort(found.inside.begin(), found.inside.end());
}

// `boxes`: by body. `vertices`: those that may be inside of the obstacle.
Blocking find_blocking(const StepTopology& topology, const Motion& motion,
                       const std::vector<Box3d>& boxes, std::int32_t obstacle,
                       const Vertices& vertices) {
  Blocking blocking;
  blocking.is_movable = motion.rigid_of(obstacle).is_movable();
  if (blocking.is_movable) return blocking;
  const auto margin_of = [&](std::int32_t body) { return topology.bodies()[body].margin; };
  double soft_margin = 0;
  for (const std::int32_t v : vertices)
    soft_margin = std::max(soft_margin, margin_of(topology.body_of(v)));
  blocking.margin = soft_margin + margin_of(obstacle);
  Box3d reach = boxes[obstacle];
  reach = Box3d(reach.min() - Vector3d::Constant(blocking.margin),
                reach.max() + Vector3d::Constant(blocking.margin));
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(boxes.size()); ++body) {
    const StepTopology::BodyRecord& record = topology.bodies()[body];
    if (record.soft || body == obstacle || motion.rigid_of(body).is_movable() ||
        !boxes[body].intersects(reach))
      continue;
    for (std::int32_t f = record.faces.first; f < record.faces.last; ++f) {
      Box3d box;
      for (const std::int32_t v : topology.topology().faces[f]) box.extend(motion.start_of(v));
      if (box.intersects(reach)) blocking.faces.push_back(f);
    }
  }
  return blocking;
}

// Finds what is inside of obstacles. `is_searched`: whether this vertex counts for this obstacle.
Penetrations find_inside_obstacles(
    const StepTopology& topology, const Intersections& intersections, Span<const Edge> edges,
    const Motion& motion, const std::function<bool(std::int32_t, std::int32_t)>& may_penetrate,
    const std::function<bool(std::int32_t, std::int32_t)>& is_searched) {
  const Topology view = topology.topology();
  Penetrations found;
  std::vector<Box3d> boxes(view.bodies.size());
  for (std::size_t v = 0; v < view.vertex_count; ++v)
    boxes[view.body_of_vertex[v]].extend(motion.start_of(static_cast<std::int32_t>(v)));
  for (std::int32_t obstacle = 0; obstacle < static_cast<std::int32_t>(boxes.size()); ++obstacle) {
    if (topology.bodies()[obstacle].soft || boxes[obstacle].isEmpty()) continue;
    const btCollisionShape& shape = *topology.bodies()[obstacle].object->getCollisionShape();
    const int shape_type = shape.getShapeType();
    const Vector3d up = up_of(topology, motion, obstacle);  // of what has no bottom
    const auto are_apart = [&](const Box3d& box) {
      return up.isZero() ? !box.intersects(boxes[obstacle])
                         : lower_end(box, up) > -lower_end(boxes[obstacle], -up);
    };
    Vertices vertices;
    for (std::int32_t body = 0; body < static_cast<std::int32_t>(boxes.size()); ++body) {
      const StepTopology::BodyRecord& record = topology.bodies()[body];
      if (!record.soft || are_apart(boxes[body]) || !may_penetrate(body, obstacle)) continue;
      const std::int32_t last = record.first_vertex + record.vertex_count;
      for (std::int32_t v = record.first_vertex; v < last; ++v)
        if (is_searched(v, obstacle)) vertices.push_back(v);
    }
    if (vertices.empty()) continue;
    Finder finder(topology, motion, obstacle, found);
    if (shape_type == STATIC_PLANE_PROXYTYPE) {
      finder.find_below_plane(vertices, intersections, edges, up);
    } else if (shape_type == TERRAIN_SHAPE_PROXYTYPE) {
      finder.find_below(vertices, up);
    } else {
      finder.find_inside(vertices, intersections, edges,
                         find_blocking(topology, motion, boxes, obstacle, vertices));
    }
  }
  sort(found);
  return found;
}

}  // namespace

Penetrations find_penetrations(const StepTopology& topology, const Intersections& intersections,
                               Span<const Edge> edges, const Motion& motion,
                               const std::function<bool(std::int32_t, std::int32_t)>& may_penetrate,
                               const std::function<bool(std::int32_t, std::int32_t)>& is_anchored) {
  return find_inside_obstacles(
      topology, intersections, edges, motion, may_penetrate,
      [&](std::int32_t v, std::int32_t obstacle) {
        return (motion.rigid_of(obstacle).is_movable() || motion.is_movable(v)) &&
               !is_anchored(v, obstacle);
      });
}

std::vector<InsideVertex> find_inside(
    const StepTopology& topology, const Motion& motion,
    const std::function<bool(std::int32_t, std::int32_t)>& may_be_inside,
    const std::function<bool(std::int32_t, std::int32_t)>& is_searched) {
  return find_inside_obstacles(topology, {}, {}, motion, may_be_inside, is_searched).inside;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
