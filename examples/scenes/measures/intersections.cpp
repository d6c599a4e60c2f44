#include "scenes/measures/intersections.h"

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <set>

namespace lazyccd::scenes {
namespace {

using Point = std::array<double, 3>;
// Exact if the largest and the smallest nonzero magnitude of the coordinates are within a factor of
// 2^600. A difference then has at most 653 bits, and the determinant at most 3 * 653 + 3.
using Exact = boost::multiprecision::number<
    boost::multiprecision::cpp_bin_float<2000, boost::multiprecision::digit_base_2>>;

template <class Number>
Number determinant(const Point& a, const Point& b, const Point& c, const Point& d) {
  std::array<std::array<Number, 3>, 3> m;
  for (int k = 0; k < 3; ++k) {
    m[0][k] = Number(a[k]) - Number(d[k]);
    m[1][k] = Number(b[k]) - Number(d[k]);
    m[2][k] = Number(c[k]) - Number(d[k]);
  }
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// Returns the sign of the side of the plane abc on which d is: -1, 0 or 1. Exact.
int side(const Point& a, const Point& b, const Point& c, const Point& d) {
  double bound = 1;
  for (int k = 0; k < 3; ++k) {
    bound *= std::max({std::abs(a[k] - d[k]), std::abs(b[k] - d[k]), std::abs(c[k] - d[k])});
  }
  // `bound` is at least as large as each of the six products, because a product has one factor from
  // every column. So their rounding errors stay far below the limit of the next test.
  const double value = determinant<double>(a, b, c, d);
  if (std::abs(value) > 1e-14 * 6 * bound) return value > 0 ? 1 : -1;
  return determinant<Exact>(a, b, c, d).sign();
}

// Returns true if the edge pq passes through the inside of the triangle abc. Exact.
bool intersects(const Point& p, const Point& q, const Point& a, const Point& b, const Point& c) {
  const int sp = side(a, b, c, p), sq = side(a, b, c, q);
  if (sp * sq >= 0) return false;
  const int s0 = side(p, q, a, b), s1 = side(p, q, b, c), s2 = side(p, q, c, a);
  return s0 != 0 && s0 == s1 && s1 == s2;
}

// Returns the point of the edge pq in the plane abc, rounded.
Point crossing(const Point& p, const Point& q, const Point& a, const Point& b, const Point& c) {
  const double vp = determinant<double>(a, b, c, p), vq = determinant<double>(a, b, c, q);
  const double t = vp == vq ? 0.5 : std::clamp(vp / (vp - vq), 0.0, 1.0);
  return {p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])};
}

struct Box {
  Point low, high;
  void add(const Point& p) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
};

bool overlap(const Box& a, const Box& b) {
  for (int k = 0; k < 3; ++k) {
    if (a.low[k] > b.high[k] || b.low[k] > a.high[k]) return false;
  }
  return true;
}

}  // namespace

std::vector<Intersection> find_intersections(const Surface& surface,
                                             const std::vector<btScalar>& positions) {
  std::vector<Point> points(positions.size() / 3);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    points[i / 3][i % 3] = static_cast<double>(positions[i]);
  }
  std::set<Edge> unique(surface.edges.begin(), surface.edges.end());
  for (const Face& face : surface.faces) {
    for (int k = 0; k < 3; ++k) {
      unique.insert({std::min(face[k], face[(k + 1) % 3]), std::max(face[k], face[(k + 1) % 3])});
    }
  }
  const std::vector<Edge> edges(unique.begin(), unique.end());

  // Sweep and prune along x.
  struct Interval {
    Box box;
    std::size_t index;
  };
  std::vector<Interval> edge_items, face_items;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    Interval item{{points[edges[i][0]], points[edges[i][0]]}, i};
    item.box.add(points[edges[i][1]]);
    edge_items.push_back(item);
  }
  for (std::size_t i = 0; i < surface.faces.size(); ++i) {
    const Face& face = surface.faces[i];
    Interval item{{points[face[0]], points[face[0]]}, i};
    item.box.add(points[face[1]]);
    item.box.add(points[face[2]]);
    face_items.push_back(item);
  }
  const auto by_low = [](const Interval& a, const Interval& b) {
    return a.box.low[0] < b.box.low[0];
  };
  std::sort(edge_items.begin(), edge_items.end(), by_low);
  std::sort(face_items.begin(), face_items.end(), by_low);

  std::vector<Intersection> found;
  std::vector<const Interval*> active;  // faces that may overlap the current edge in x
  std::size_t next = 0;
  for (const Interval& item : edge_items) {
    while (next < face_items.size() && face_items[next].box.low[0] <= item.box.high[0]) {
      active.push_back(&face_items[next++]);
    }
    // Later edges start later. So a face that ends before this edge starts is not needed again.
    active.erase(
        std::remove_if(active.begin(), active.end(),
                       [&](const Interval* f) { return f->box.high[0] < item.box.low[0]; }),
        active.end());
    const Edge& edge = edges[item.index];
    const std::int32_t body = surface.body_of_vertex[edge[0]];
    for (const Interval* candidate : active) {
      const Face& face = surface.faces[candidate->index];
      const std::int32_t other = surface.body_of_vertex[face[0]];
      const Body &a = surface.bodies[body], &b = surface.bodies[other];
      const bool collide = body == other ? a.self_collision : filters_accept(a, b);
      if (!collide || !overlap(item.box, candidate->box)) continue;
      const bool shared = std::any_of(face.begin(), face.end(),
                                      [&](std::int32_t v) { return v == edge[0] || v == edge[1]; });
      if (shared) continue;
      const Point &p = points[edge[0]], &q = points[edge[1]];
      const Point &a0 = points[face[0]], &a1 = points[face[1]], &a2 = points[face[2]];
      if (intersects(p, q, a0, a1, a2)) found.push_back({edge, face, crossing(p, q, a0, a1, a2)});
    }
  }
  return found;
}

}  // namespace lazyccd::scenes
