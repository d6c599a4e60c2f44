#include "obstacles/internal_edges.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "settings.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

bool sags_little(double length, double turn, double thickness) {
  return 0.25 * length * turn <= settings::internal_edges::max_sag * thickness;
}

}  // namespace

void InternalEdges::set_topology(Span<const Edge> edges, Span<const Body> filters,
                                 double largest_thickness) {
  const Topology topology = topology_.topology();
  const auto first_edge = std::partition_point(
      edges.begin(), edges.end(), [this](const Edge& e) { return topology_.is_soft(e[1]); });
  const auto first_face =
      std::find_if(topology.faces.begin(), topology.faces.end(),
                   [this](const Face& face) { return !topology_.is_soft(face[0]); });
  first_edge_ = static_cast<std::size_t>(first_edge - edges.begin());
  first_face_ = static_cast<std::size_t>(first_face - topology.faces.begin());
  bends_ = measure_bends({first_face, topology.faces.size() - first_face_},
                         {first_edge, edges.size() - first_edge_}, motion_.start(),
                         motion_.soft_count());
  edges_left_out_.clear();
  vertices_left_out_.clear();
  for (ObstaclePairs& obstacle : find_obstacle_pairs(topology_)) {
    std::vector<std::int32_t>& soft_bodies = obstacle.soft_bodies;
    const auto passes = [&](std::int32_t s) {
      return !filters_accept(filters[s], filters[obstacle.body]);
    };
    soft_bodies.erase(std::remove_if(soft_bodies.begin(), soft_bodies.end(), passes),
                      soft_bodies.end());
    if (!soft_bodies.empty() && !is_movable(obstacle.body))
      leave_out(obstacle, edges, largest_thickness);
  }
  const auto count = std::count(edges_left_out_.begin(), edges_left_out_.end(), 1);
  if (static_cast<double>(count) >=
      settings::internal_edges::min_left_out_of_scene * static_cast<double>(edges.size()))
    return;
  edges_left_out_.clear();
  vertices_left_out_.clear();
}

void InternalEdges::leave_out(const ObstaclePairs& obstacle, Span<const Edge> edges,
                              double largest_thickness) {
  const StepTopology::BodyRecord& record = topology_.bodies()[obstacle.body];
  double length = 0, thickness = largest_thickness;
  for (const std::int32_t s : obstacle.soft_bodies) {
    length = std::max(length,
                      settings::internal_edges::max_stretch * longest_edge(topology_, s, motion_));
    thickness = std::min(thickness, surfaces_.of(s, obstacle.body).thickness);
  }
  const std::int32_t first = record.first_vertex, last = first + record.vertex_count;
  const auto first_edge =
      std::partition_point(edges.begin(), edges.end(), [&](const Edge& e) { return e[1] < first; });
  const auto last_edge =
      std::partition_point(first_edge, edges.end(), [&](const Edge& e) { return e[1] < last; });
  const auto is_internal = [&](const Edge& edge) {
    double turn = turn_at_edge(static_cast<std::size_t>(&edge - edges.begin()), length);
    for (const std::int32_t v : edge) turn = std::max(turn, turn_at_vertex(v, length));
    return sags_little(length, turn, thickness);
  };
  const auto count = std::count_if(first_edge, last_edge, is_internal);
  if (count == 0 || static_cast<double>(count) <
                        settings::internal_edges::min_left_out * (last_edge - first_edge))
    return;
  edges_left_out_.resize(edges.size());
  vertices_left_out_.resize(static_cast<std::size_t>(topology_.vertex_count()));
  std::fill_n(vertices_left_out_.begin() + first, record.vertex_count, 1);
  for (auto edge = first_edge; edge != last_edge; ++edge) {
    const bool left_out = is_internal(*edge);
    edges_left_out_[edge - edges.begin()] = left_out;
    for (const std::int32_t v : *edge) vertices_left_out_[v] = vertices_left_out_[v] && left_out;
  }
}

void InternalEdges::remove(std::vector<Contact>& contacts) const {
  auto kept = contacts.begin();
  for (auto first = contacts.begin(), last = first; first != contacts.end(); first = last) {
    const std::int32_t a = first->body_a, b = first->body_b;
    last = std::partition_point(first, contacts.end(), [a, b](const Contact& contact) {
      return contact.body_a == a && contact.body_b == b;
    });
    auto last_kept = last;
    if (may_need_none(a, b)) {
      const double thickness = surfaces_.of(a, b).thickness;
      last_kept = std::remove_if(first, last, [&](const Contact& contact) {
        return !needs_constraint(contact, thickness);
      });
    }
    kept = kept == first ? last_kept : std::move(first, last_kept, kept);
  }
  contacts.erase(kept, contacts.end());
}

bool InternalEdges::may_need_none(std::int32_t body_a, std::int32_t body_b) const {
  const auto is_soft = [this](std::int32_t body) { return topology_.bodies()[body].soft; };
  return !(is_soft(body_a) && is_soft(body_b)) && !is_movable(is_soft(body_a) ? body_b : body_a);
}

bool InternalEdges::needs_constraint(const Contact& contact, double thickness) const {
  // What is pressed closer is held by all that it has.
  if (contact.toi == 0 && gap_at_start(contact) < settings::internal_edges::max_sag * thickness)
    return true;
  return contact.kind == ContactKind::vertex_face && topology_.bodies()[contact.body_a].soft
             ? !is_beyond_edge(contact, thickness)
             : !is_internal(contact, thickness);
}

bool InternalEdges::is_internal(const Contact& contact, double thickness) const {
  const bool is_edge = contact.kind == ContactKind::edge_edge;
  const std::int32_t* const soft = &contact.vertices[is_edge ? 0 : 1];
  const int count = is_edge ? 2 : 3;
  if (!std::all_of(soft, soft + count, [this](std::int32_t v) { return motion_.is_free(v); }))
    return false;
  double squared = 0;  // of the longest soft edge
  for (int i = 0; i < (is_edge ? 1 : 3); ++i)
    squared = std::max(squared, squared_length(soft[i], soft[(i + 1) % count]));
  const double length = std::sqrt(squared);
  const double turn =
      is_edge ? std::max(turn_at_edge(static_cast<std::size_t>(contact.primitive_b), length),
                         turn_around_ends(contact, length))
              : turn_at_vertex(contact.primitive_a, length);
  return sags_little(length, turn, thickness);
}

// The closest point lies at an edge or a corner of the face, and the contact does not lie along a
// normal there. So another face is nearer.
bool InternalEdges::is_beyond_edge(const Contact& contact, double thickness) const {
  const float weights[] = {1 - contact.u - contact.v, contact.u, contact.v};
  const auto zeros = std::count_if(weights, weights + 3,
                                   [](float w) { return w < settings::internal_edges::border; });
  if (zeros == 0) return false;
  const double length = motion_.shortest_edge()[contact.primitive_a];
  double angle;
  if (zeros == 1) {
    const auto corner = std::find_if(weights, weights + 3,
                                     [](float w) { return w < settings::internal_edges::border; });
    const auto side = static_cast<std::size_t>((corner - weights + 1) % 3);
    const auto face = static_cast<std::size_t>(contact.primitive_b) - first_face_;
    angle = bends_.angles[static_cast<std::size_t>(bends_.edge_of_side[3 * face + side])];
  } else {
    const auto corner = std::max_element(weights, weights + 3) - weights;
    angle = turn_at_vertex(contact.vertices[1 + corner], length);
  }
  if (!sags_little(length, angle, thickness)) return false;
  const auto at_contact = [&](std::int32_t v) -> Vector3d {
    return (1 - contact.toi) * motion_.start_of(v) + contact.toi * motion_.end_of(v);
  };
  const Vector3d a = at_contact(contact.vertices[1]);
  const Vector3d of_face =
      (at_contact(contact.vertices[2]) - a).cross(at_contact(contact.vertices[3]) - a);
  const Vector3d normal = vector_of(contact.normal.data());
  return std::abs(of_face.dot(normal)) <
         std::cos(angle + settings::internal_edges::normal_tolerance) * of_face.norm();
}

bool InternalEdges::is_movable(std::int32_t obstacle) const {
  return motion_.rigid_of(obstacle).is_movable();
}

double InternalEdges::gap_at_start(const Contact& contact) const {
  const std::array<double, 4> weights = contact.weights();
  Vector3d gap = Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i) gap += weights[i] * motion_.start_of(contact.vertices[i]);
  return gap.norm();
}

double InternalEdges::squared_length(std::int32_t a, std::int32_t b) const {
  return (motion_.start_of(a) - motion_.start_of(b)).squaredNorm();
}

double InternalEdges::turn_at_edge(std::size_t edge, double length) const {
  const std::size_t i = edge - first_edge_;
  return std::max<double>(bends_.angles[i], bends_.curvatures[i] * length);
}

double InternalEdges::turn_at_vertex(std::int32_t vertex, double length) const {
  const auto i = static_cast<std::size_t>(vertex - motion_.soft_count());
  const double curvature = bends_.vertex_curvatures[i];
  if (std::isinf(curvature)) return curvature;  // the vertex of a sharp edge
  return std::max<double>(bends_.vertex_angles[i], curvature * length);
}

// Around the ends of an edge the surface may turn more, as around the apex of a cone: at the
// distance s from there, by a part of that which is as large as the length by s.
double InternalEdges::turn_around_ends(const Contact& contact, double length) const {
  const std::int32_t ends[] = {contact.vertices[2], contact.vertices[3]};
  const double obstacle_length = std::sqrt(squared_length(ends[0], ends[1]));
  const double from_first = static_cast<double>(contact.v) * obstacle_length;
  const double distances[] = {from_first, obstacle_length - from_first};
  double turn = 0;
  for (int i = 0; i < 2; ++i) {
    const double angle = bends_.vertex_angles[ends[i] - motion_.soft_count()];
    turn = std::max(turn, angle * std::min(1.0, length / distances[i]));
  }
  return turn;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
