#include "obstacles/convex_pair.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "obstacles/obstacle_pairs.h"
#include "settings.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

struct Triangle {
  Vector3d a, b, c;
};

struct PointOnTriangle {
  Vector3d x;
  double u, v;  // barycentric coordinates of corners b and c
};

PointOnTriangle closest_on_sides(const Vector3d& x, const Triangle& triangle) {
  const auto& [a, b, c] = triangle;
  const double s = place_on_segment(x, a, b), t = place_on_segment(x, a, c),
               r = place_on_segment(x, b, c);
  const std::array<PointOnTriangle, 3> closest = {
      {{a + s * (b - a), s, 0}, {a + t * (c - a), 0, t}, {b + r * (c - b), 1 - r, r}}};
  return *std::min_element(closest.begin(), closest.end(), [&x](const auto& p, const auto& q) {
    return (x - p.x).squaredNorm() < (x - q.x).squaredNorm();
  });
}

}  // namespace

ConvexPair::ConvexPair(const StepTopology& topology, const Motion& motion, std::int32_t soft_body,
                       std::int32_t obstacle)
    : topology_(topology),
      motion_(motion),
      soft_body_(soft_body),
      obstacle_(obstacle),
      records_(static_cast<std::size_t>(soft().vertex_count)),
      sides_(records_.size()) {}

void ConvexPair::find_heights(std::int32_t vertex) {
  VertexRecord& record = record_of(vertex);
  if (record.heights >= 0) return;
  const auto sides = static_cast<std::size_t>(part_->side_count());
  record.heights = static_cast<std::int32_t>(heights_.size());
  heights_.resize(heights_.size() + 2 * sides);
  double* const start = &heights_[static_cast<std::size_t>(record.heights)];
  part_->find_heights(start_of(vertex), end_of(vertex), start, start + sides);
}

VertexHeights ConvexPair::heights_of(std::int32_t vertex) {
  const double* const start = &heights_[static_cast<std::size_t>(record_of(vertex).heights)];
  return {start, start + part_->side_count()};
}

template <class Primitive>
MovingPrimitive ConvexPair::moving(const Primitive& primitive) {
  MovingPrimitive moving{
      points_of(primitive, motion_, true), points_of(primitive, motion_, at_start_), {}};
  for (const std::int32_t v : primitive) find_heights(v);
  for (std::size_t i = 0; i < primitive.size(); ++i) moving.heights[i] = heights_of(primitive[i]);
  return moving;
}

bool ConvexPair::read_vertices(const MovingPolyhedron& part,
                               const std::vector<std::int32_t>& vertices, bool at_start,
                               double height) {
  part_ = &part;
  at_start_ = at_start;
  heights_.clear();
  if (!part.is_finite()) return false;
  for (const std::int32_t v : vertices) {
    const Vector3d x0 = start_of(v), x1 = end_of(v);
    if (!x1.allFinite()) return false;
    VertexRecord& record = record_of(v);
    record.is_held = false;
    record.heights = -1;
    record.height = part.height_above(record.side, x0, x1);
    if (record.height > height) continue;
    find_heights(v);
    record.side = part.highest_side(heights_of(v));
    record.height = part.height_above(record.side, x0, x1);
  }
  return true;
}

void ConvexPair::note_sides(const std::vector<std::int32_t>& vertices, double height) {
  for (const std::int32_t v : vertices) {
    const VertexRecord& record = record_of(v);
    sides_[static_cast<std::size_t>(v - soft().first_vertex)] =
        record.is_held || record.height >= height ? record.side : -1;
  }
}

template <class Primitive>
bool ConvexPair::is_above_one_side(const Primitive& primitive, double height) {
  const std::int32_t first = soft().first_vertex, common = sides_[primitive[0] - first];
  bool all_noted = common >= 0;
  for (const std::int32_t v : primitive) all_noted = all_noted && sides_[v - first] == common;
  if (all_noted) return true;
  const auto is_above = [&](std::int32_t v, std::int32_t side) {
    const VertexRecord& record = record_of(v);
    if (record.side == side) return record.is_held || record.height >= height;
    return part_->height_above(side, start_of(v), end_of(v)) >= height;
  };
  for (const std::int32_t v : primitive) {
    const std::int32_t side = record_of(v).side;
    bool all_above = true;
    for (const std::int32_t other : primitive) all_above = all_above && is_above(other, side);
    if (all_above) return true;
  }
  return part_->is_above_one_side(moving(primitive), height);
}

bool ConvexPair::find_near(const MovingPolyhedron& part, const NearPrimitives& near,
                           double separation, double thickness, std::vector<Contact>& contacts) {
  if (!read_vertices(part, near.vertices, false, separation)) return false;
  for (const std::int32_t v : near.vertices) {
    VertexRecord& record = record_of(v);
    if (record.heights < 0) continue;
    const VertexHeights heights = heights_of(v);
    if (!part.starts_outside(heights)) return false;
    double time;
    std::int32_t side;
    if (!part.find_near(heights, separation, time, side)) continue;
    contacts.push_back(vertex_contact(v, side, time));
    record.side = side;
    record.height = std::min(heights.start[side], heights.end[side]);
    record.is_held = true;
  }
  find_near_edges(near, separation, settings::simple_shapes::held_height * thickness, contacts);
  return true;
}

// Edges and faces that the constraints of their vertices do not keep clear.
void ConvexPair::find_near_edges(const NearPrimitives& near, double separation, double held_height,
                                 std::vector<Contact>& contacts) {
  const Topology topology = topology_.topology();
  note_sides(near.vertices, held_height);
  edges_.clear();
  const auto add_edge = [&](std::int32_t a, std::int32_t b, std::int32_t index) {
    const Edge edge = {std::min(a, b), std::max(a, b)};
    if (!is_above_one_side(edge, held_height)) edges_.push_back({edge, index});
  };
  double time;
  SeparatingPlane plane;
  for (const std::int32_t f : near.faces) {
    const Face& face = topology.faces[f];
    if (is_above_one_side(face, held_height)) continue;
    for (int k = 0; k < 3; ++k)
      add_edge(face[k], face[(k + 1) % 3], first_side_index(topology) + 3 * f + k);
    if (part_->find_near(moving(face), separation, time, plane) && plane.height > 0)
      contacts.push_back(face_contact(f, plane, time));
  }
  for (const std::int32_t e : near.edges)
    add_edge(topology.edges[e][0], topology.edges[e][1], first_edge_index(topology) + e);
  std::sort(edges_.begin(), edges_.end(), [](const NearEdge& a, const NearEdge& b) {
    return std::tie(a.vertices, a.index) < std::tie(b.vertices, b.index);
  });
  edges_.erase(std::unique(edges_.begin(), edges_.end(),
                           [](const auto& a, const auto& b) { return a.vertices == b.vertices; }),
               edges_.end());
  for (const NearEdge& edge : edges_) add_edge_contacts(edge, separation, contacts);
}

Vector3d ConvexPair::normal_at(std::int32_t side, double time) const {
  const btVector3& local = part_->part().sides[static_cast<std::size_t>(side)].normal;
  const RigidMotion& rigid = motion_.rigid_of(obstacle_);
  return ((1 - time) * to_double(rigid.start.getBasis() * local) +
          time * to_double(rigid.end.getBasis() * local))
      .normalized();
}

Contact ConvexPair::vertex_contact(std::int32_t vertex, std::int32_t side, double time) const {
  const Topology topology = topology_.topology();
  const Vector3d x = position(vertex, time), of_side = normal_at(side, time);
  Contact contact;
  contact.kind = ContactKind::vertex_face;
  contact.body_a = soft_body_;
  contact.body_b = obstacle_;
  contact.primitive_a = vertex;
  contact.toi = time;
  const auto face_of = [&](std::int32_t f) { return obstacle().faces.first + f; };
  const auto triangle_of = [&](std::int32_t f) {
    const Face& face = topology.faces[static_cast<std::size_t>(face_of(f))];
    return Triangle{position(face[0], time), position(face[1], time), position(face[2], time)};
  };
  const auto set_point = [&](std::int32_t f, double u, double v) {
    const Face& face = topology.faces[static_cast<std::size_t>(face_of(f))];
    contact.primitive_b = face_of(f);
    contact.vertices = {vertex, face[0], face[1], face[2]};
    contact.u = static_cast<float>(u);
    contact.v = static_cast<float>(v);
  };
  const std::vector<std::int32_t>& faces = part_->part().sides[side].faces;
  set_normal(of_side, contact);
  for (const std::int32_t f : faces) {
    const auto [a, b, c] = triangle_of(f);
    const TrianglePlane plane(a, b, c);
    if (!plane.exists()) continue;
    const std::array<double, 3> weights = plane.weights_below(x);
    if (!is_inside(weights)) continue;
    set_point(f, weights[1], weights[2]);
    return contact;
  }
  // Beyond the edges of the side the normal turns with the vertex.
  double nearest = std::numeric_limits<double>::infinity();
  for (const std::int32_t f : faces) {
    const PointOnTriangle point = closest_on_sides(x, triangle_of(f));
    const Vector3d gap = x - point.x;
    const double distance = gap.norm();
    if (!(distance < nearest)) continue;
    nearest = distance;
    set_point(f, point.u, point.v);
    if (gap.dot(of_side) > 0) set_normal(gap / distance, contact);
  }
  return contact;
}

// The nearest ridge of both sides. Around a corner these may be no neighbours; then the nearest of
// either.
ConvexPair::RidgePoint ConvexPair::closest_ridge(const Edge& edge,
                                                 const std::array<std::int32_t, 2>& sides,
                                                 double time) const {
  const std::int32_t first = obstacle().first_vertex;
  const Vector3d a = position(edge[0], time), u = position(edge[1], time) - a;
  RidgePoint closest{nullptr, {}};
  int most_sides = 1;
  double nearest = std::numeric_limits<double>::infinity();
  for (const ConvexPart::Ridge& ridge : part_->part().ridges) {
    const auto has = [&ridge](std::int32_t side) {
      return ridge.sides[0] == side || ridge.sides[1] == side ? 1 : 0;
    };
    const int count = has(sides[0]) + has(sides[1]);
    if (count < most_sides) continue;
    const Vector3d b = position(first + ridge.vertices[0], time),
                   v = position(first + ridge.vertices[1], time) - b;
    const ClosestOnSegments points = closest_on_segments(a, u, b, v);
    const double distance = points.gap.squaredNorm();
    if (count == most_sides && !(distance < nearest)) continue;
    most_sides = count;
    nearest = distance;
    closest = {&ridge, points};
  }
  return closest;
}

void ConvexPair::add_edge_contacts(const NearEdge& edge, double separation,
                                   std::vector<Contact>& contacts) {
  const MovingPrimitive primitive = moving(edge.vertices);
  double time;
  SeparatingPlane plane;
  if (!part_->find_near(primitive, separation, time, plane) || !(plane.height > 0)) return;
  // Of an end of the edge the constraint of the vertex is enough.
  const auto is_between_ends = [](const RidgePoint& at) {
    return at.ridge && at.points.s > 0 && at.points.s < 1;
  };
  const RidgePoint at = closest_ridge(edge.vertices, plane.sides, time);
  if (is_between_ends(at)) contacts.push_back(edge_contact(edge, plane, at, time));
  SeparatingPlane next;
  if (!part_->find_next(primitive, time, plane, next) ||
      !(next.height < plane.height + settings::simple_shapes::next_side_height * separation))
    return;
  const RidgePoint other = closest_ridge(edge.vertices, next.sides, time);
  if (is_between_ends(other) && other.ridge != at.ridge)
    contacts.push_back(edge_contact(edge, next, other, time));
}

Contact ConvexPair::edge_contact(const NearEdge& edge, const SeparatingPlane& plane,
                                 const RidgePoint& at, double time) const {
  Contact contact;
  contact.kind = ContactKind::edge_edge;
  contact.body_a = soft_body_;
  contact.body_b = obstacle_;
  contact.primitive_a = edge.index;
  contact.primitive_b = 3 * (obstacle().faces.first + at.ridge->face) + at.ridge->corner;
  contact.vertices = {edge.vertices[0], edge.vertices[1],
                      obstacle().first_vertex + at.ridge->vertices[0],
                      obstacle().first_vertex + at.ridge->vertices[1]};
  contact.u = static_cast<float>(at.points.s);
  contact.v = static_cast<float>(at.points.t);
  set_normal(at.points.gap.dot(plane.normal) > 0 ? at.points.gap.normalized() : plane.normal,
             contact);
  contact.toi = time;
  return contact;
}

Contact ConvexPair::face_contact(std::int32_t face, const SeparatingPlane& plane,
                                 double time) const {
  const Face& corners = topology_.topology().faces[static_cast<std::size_t>(face)];
  const std::int32_t vertex = obstacle().first_vertex + plane.vertex;
  Contact contact;
  contact.kind = ContactKind::vertex_face;
  contact.body_a = obstacle_;
  contact.body_b = soft_body_;
  contact.primitive_a = vertex;
  contact.primitive_b = face;
  contact.vertices = {vertex, corners[0], corners[1], corners[2]};
  contact.u = static_cast<float>(plane.weights[1]);
  contact.v = static_cast<float>(plane.weights[2]);
  set_normal(-plane.normal, contact);
  contact.toi = time;
  return contact;
}

bool ConvexPair::is_clear(const MovingPolyhedron& part, const NearPrimitives& near, bool at_start) {
  if (!read_vertices(part, near.vertices, at_start, 0)) return false;
  constexpr double more_than_none = std::numeric_limits<double>::min();
  note_sides(near.vertices, more_than_none);
  const Topology topology = topology_.topology();
  const auto are_clear = [&](const auto& primitives, const std::vector<std::int32_t>& indices) {
    return std::all_of(indices.begin(), indices.end(), [&](std::int32_t i) {
      const auto& primitive = primitives[i];
      return is_above_one_side(primitive, more_than_none) || part_->is_clear(moving(primitive));
    });
  };
  return are_clear(topology.faces, near.faces) && are_clear(topology.edges, near.edges);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
