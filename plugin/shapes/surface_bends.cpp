#include "shapes/surface_bends.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "settings.h"
#include "util/disjoint_sets.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double angle_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// A corner of a face has the index 3 * face + k. Side k of the face starts there.
class Measurement {
 public:
  Measurement(Span<const Face> faces, Span<const Edge> edges,
              const std::vector<btScalar>& positions, std::int32_t first_vertex)
      : faces_(faces),
        edges_(edges),
        positions_(positions),
        first_vertex_(first_vertex),
        sides_(edges.size()),
        turns_(edges.size()),
        sectors_(3 * faces.size()) {}

  SurfaceBends run() {
    read_faces();
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      turns_[e] = turn_at(sides_[e]);
      if (turns_[e] < infinity) join_sectors(sides_[e]);
    }
    SurfaceBends bends;
    const auto vertex_count = positions_.size() / 3 - static_cast<std::size_t>(first_vertex_);
    bends.edge_of_side = edge_of_side_;
    bends.vertex_angles = sector_turns(vertex_count);
    bends.vertex_curvatures.assign(vertex_count, 0);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const auto curvature =
          static_cast<float>(turns_[e] < infinity ? turns_[e] / mean_height(e) : infinity);
      bends.angles.push_back(static_cast<float>(turns_[e]));
      bends.curvatures.push_back(curvature);
      for (const std::int32_t v : edges_[e]) {
        float& largest = bends.vertex_curvatures[static_cast<std::size_t>(v - first_vertex_)];
        largest = std::max(largest, curvature);
      }
    }
    return bends;
  }

 private:
  // The first two sides at an edge, by their first corners, and their number.
  struct Sides {
    int count = 0;
    std::array<std::int32_t, 2> corner;
  };

  Vector3d position(std::int32_t vertex) const {
    const btScalar* const x = &positions_[3 * static_cast<std::size_t>(vertex)];
    return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
  }
  std::int32_t vertex_at(std::int32_t corner) const { return faces_[corner / 3][corner % 3]; }
  static std::int32_t next(std::int32_t corner) {
    return corner % 3 == 2 ? corner - 2 : corner + 1;
  }

  std::size_t edge_between(std::int32_t a, std::int32_t b) const {
    const auto at = std::lower_bound(
        edges_.begin(), edges_.end(), Edge{std::min(a, b), std::max(a, b)},
        [](const Edge& x, const Edge& y) { return x[1] != y[1] ? x[1] < y[1] : x[0] < y[0]; });
    return static_cast<std::size_t>(at - edges_.begin());
  }

  void read_faces() {
    for (const Face& face : faces_) {
      const Vector3d a = position(face[0]);
      const auto first = static_cast<std::int32_t>(3 * normals_.size());
      normals_.push_back((position(face[1]) - a).cross(position(face[2]) - a));
      for (std::int32_t corner = first; corner < first + 3; ++corner) {
        const std::size_t edge = edge_between(vertex_at(corner), vertex_at(next(corner)));
        edge_of_side_.push_back(static_cast<std::int32_t>(edge));
        Sides& at = sides_[edge];
        if (at.count < 2) at.corner[at.count] = corner;
        ++at.count;
      }
    }
  }

  // Angle between the two faces of an edge; infinite if the edge is sharp.
  double turn_at(const Sides& at) const {
    if (at.count != 2 || vertex_at(at.corner[0]) == vertex_at(at.corner[1])) return infinity;
    const Vector3d &a = normals_[at.corner[0] / 3], &b = normals_[at.corner[1] / 3];
    const double angle = angle_between(a, b);
    return angle <= settings::shapes::sharp_angle && !a.isZero() && !b.isZero() ? angle : infinity;
  }

  // A sector: the corners around a vertex, from one sharp edge to the next. The two faces of an
  // edge run along it in opposite directions.
  void join_sectors(const Sides& at) {
    sectors_.join(at.corner[0], next(at.corner[1]));
    sectors_.join(next(at.corner[0]), at.corner[1]);
  }

  // Returns the largest turn of a sector by vertex: twice the largest angle from its mean normal.
  std::vector<float> sector_turns(std::size_t vertex_count) {
    const auto corner_count = static_cast<std::int32_t>(sectors_.size());
    std::vector<Vector3d> sums(sectors_.size(), Vector3d::Zero());
    for (std::int32_t c = 0; c < corner_count; ++c)
      sums[sectors_.find(c)] += normals_[c / 3].normalized();
    std::vector<float> turns(vertex_count, 0);
    for (std::int32_t c = 0; c < corner_count; ++c) {
      float& largest = turns[static_cast<std::size_t>(vertex_at(c) - first_vertex_)];
      const double turn = 2 * angle_between(normals_[c / 3], sums[sectors_.find(c)]);
      largest = std::max(largest, static_cast<float>(turn));
    }
    return turns;
  }

  // Of the two faces over an edge, metres.
  double mean_height(std::size_t edge) const {
    double areas = 0;  // twice
    for (int i = 0; i < std::min(sides_[edge].count, 2); ++i)
      areas += normals_[sides_[edge].corner[i] / 3].norm();
    return 0.5 * areas / (position(edges_[edge][0]) - position(edges_[edge][1])).norm();
  }

  Span<const Face> faces_;
  Span<const Edge> edges_;
  const std::vector<btScalar>& positions_;
  std::int32_t first_vertex_;
  std::vector<Vector3d> normals_;  // by face; as long as twice its area, m^2
  std::vector<std::int32_t> edge_of_side_;
  std::vector<Sides> sides_;   // by edge
  std::vector<double> turns_;  // by edge, radians
  DisjointSets sectors_;       // of corners
};

}  // namespace

SurfaceBends measure_bends(Span<const Face> faces, Span<const Edge> edges,
                           const std::vector<btScalar>& positions, std::int32_t first_vertex) {
  return Measurement(faces, edges, positions, first_vertex).run();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
