#include "touching/touching_pairs.h"

#include <algorithm>

#include "motion/closest_points.h"
#include "touching/bodies_that_meet.h"
#include "touching/strips.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Collects the pairs of one search.
class Finder {
 public:
  Finder(const Topology& topology, Span<const Edge> edges, const std::vector<Vector3d>& x,
         const std::vector<double>& rounding, std::int32_t soft_count, const TouchingQuery& query)
      : topology_(topology),
        edges_(edges),
        x_(x),
        rounding_(rounding),
        soft_count_(soft_count),
        query_(query),
        is_asked_for_(bodies_asked_for(topology, query.of_bodies)) {}

  std::vector<TouchingPair> find() {
    const auto reach = [this](std::int32_t v) { return rounding_[v]; };
    const std::vector<char> body_meets =
        find_bodies_that_meet(topology_, x_, reach, query_.collide, is_asked_for_);
    const auto may_touch = [&](std::int32_t v) {
      return body_meets[topology_.body_of_vertex[v]] != 0;
    };
    std::vector<std::array<std::int32_t, 1>> vertices(x_.size());
    for (std::size_t v = 0; v < x_.size(); ++v) vertices[v] = {static_cast<std::int32_t>(v)};
    const Strips strips(x_, edges_.size());
    const auto boxes_of = [&](const auto& primitives) {
      return strips.boxes_of(primitives, x_, may_touch, reach);
    };
    const std::vector<Strips::Box> edge_boxes = boxes_of(edges_);
    strips.sweep(boxes_of(vertices), boxes_of(topology_.faces),
                 [this](const Strips::Box& a, const Strips::Box& b) {
                   if (overlap(a, b)) test_vertex(a.primitive, b.primitive);
                 });
    strips.sweep(edge_boxes, edge_boxes, [this](const Strips::Box& a, const Strips::Box& b) {
      if (overlap(a, b)) test_edges(a.primitive, b.primitive);
    });
    std::sort(found_.begin(), found_.end(),
              [](const TouchingPair& a, const TouchingPair& b) { return a.contact < b.contact; });
    return std::move(found_);
  }

 private:
  static bool overlap(const Strips::Box& a, const Strips::Box& b) {
    return is_below(a.lower, b.upper) && is_below(b.lower, a.upper);
  }

  bool may_touch(std::int32_t body_a, std::int32_t body_b) const {
    return body_a != body_b && (is_asked_for_[body_a] || is_asked_for_[body_b]) &&
           query_.collide(body_a, body_b);
  }

  void test_vertex(std::int32_t vertex, std::int32_t face) {
    const Face& f = topology_.faces[face];
    const std::int32_t a = topology_.body_of_vertex[vertex], b = topology_.body_of_vertex[f[0]];
    if ((vertex >= soft_count_ && f[0] >= soft_count_) || !may_touch(a, b)) return;
    const std::array<double, 3> weights =
        closest_on_triangle(x_[vertex], x_[f[0]], x_[f[1]], x_[f[2]]);
    add(ContactKind::vertex_face, {a, b}, {vertex, face}, {vertex, f[0], f[1], f[2]},
        {1, -weights[0], -weights[1], -weights[2]});
  }

  void test_edges(std::int32_t first, std::int32_t second) {
    const std::int32_t a = topology_.body_of_vertex[edges_[first][0]],
                       b = topology_.body_of_vertex[edges_[second][0]];
    if (a >= b) return;  // each pair comes twice
    const Edge &e = edges_[first], &f = edges_[second];
    if ((e[0] >= soft_count_ && f[0] >= soft_count_) || !may_touch(a, b)) return;
    const ClosestOnSegments points =
        closest_on_segments(x_[e[0]], x_[e[1]] - x_[e[0]], x_[f[0]], x_[f[1]] - x_[f[0]]);
    add(ContactKind::edge_edge, {a, b}, {first, second}, {e[0], e[1], f[0], f[1]},
        {1 - points.s, points.s, -(1 - points.t), -points.t});
  }

  void add(ContactKind kind, const BodyPair& bodies, const std::array<std::int32_t, 2>& primitives,
           const std::array<std::int32_t, 4>& vertices, const std::array<double, 4>& weights) {
    TouchingPair pair = {{}, weights, Vector3d::Zero()};
    double bound = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      pair.gap += weights[i] * x_[vertices[i]];
      bound = std::max(bound, rounding_[vertices[i]]);
    }
    if (pair.gap.norm() > bound) return;
    pair.contact.kind = kind;
    pair.contact.body_a = bodies[0];
    pair.contact.body_b = bodies[1];
    pair.contact.primitive_a = primitives[0];
    pair.contact.primitive_b = primitives[1];
    pair.contact.vertices = vertices;
    if (query_.responds(pair.contact)) found_.push_back(pair);
  }

  const Topology& topology_;
  Span<const Edge> edges_;
  const std::vector<Vector3d>& x_;
  const std::vector<double>& rounding_;
  std::int32_t soft_count_;
  const TouchingQuery& query_;
  std::vector<char> is_asked_for_;  // by body
  std::vector<TouchingPair> found_;
};

}  // namespace

std::vector<TouchingPair> find_touching_pairs(const Topology& topology, Span<const Edge> edges,
                                              const std::vector<Vector3d>& x,
                                              const std::vector<double>& rounding,
                                              std::int32_t soft_count, const TouchingQuery& query) {
  return Finder(topology, edges, x, rounding, soft_count, query).find();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
