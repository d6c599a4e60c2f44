// The grid of faces against all faces.
#include "untangling/face_grid.h"

#include <cmath>
#include <limits>
#include <random>

#include "support/catch.h"
#include "untangling/closed_surfaces.h"
#include "util/matrix.h"

using namespace lazyccd;
using bullet::Vector3d;

namespace {

// A closed surface with dents, and faces of very different sizes. Many of its vertices lie on lines
// parallel to the axes.
struct Surface {
  std::vector<Face> faces;
  bullet::Motion motion;
  std::vector<std::int32_t> all;

  explicit Surface(int count) {
    constexpr double pi = 3.14159265358979;
    const auto add = [&](double x, double y, double z) {
      for (const double value : {x, y, z})
        motion.input().start.push_back(static_cast<btScalar>(std::round(64 * value) / 64));
    };
    add(0, 0, -1);
    for (int i = 1; i < count; ++i) {
      for (int j = 0; j < count; ++j) {
        const double u = pi * i / count, v = 2 * pi * j / count;
        const double r = (1 + 0.3 * std::cos(3 * v) * std::sin(2 * u)) * std::sin(u);
        add(r * std::cos(v), r * std::sin(v), -std::cos(u) * (1 - 0.4 * std::sin(5 * u)));
      }
    }
    add(0, 0, 1);
    const auto vertex = [count](int i, int j) {
      return i == 0 ? 0 : i == count ? count * (count - 1) + 1 : 1 + (i - 1) * count + j % count;
    };
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < count; ++j) {
        if (i > 0) faces.push_back({vertex(i, j), vertex(i, j + 1), vertex(i + 1, j)});
        if (i + 1 < count)
          faces.push_back({vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)});
      }
    }
    for (std::size_t f = 0; f < faces.size(); ++f) all.push_back(static_cast<std::int32_t>(f));
  }
};

}  // namespace

TEST_CASE("a grid of faces knows what is inside, and the nearest face") {
  const int axis = GENERATE(0, 1, 2, 3);
  CAPTURE(axis);
  const Surface surface(24);
  Topology topology;
  topology.faces = surface.faces;
  const bullet::FaceGeometry geometry(topology, surface.motion);
  const Vector3d up = axis < 3 ? Vector3d(Vector3d::Unit(axis)) : Vector3d(1, -2, 2) / 3;
  const bullet::FaceGrid grid(geometry, up, surface.all);
  std::mt19937 random(3);
  std::uniform_int_distribution<int> coordinate(-90, 90);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    // Also exactly above and below vertices.
    const Vector3d x = Vector3d(coordinate(random), coordinate(random), coordinate(random)) / 64;
    double shortest = std::numeric_limits<double>::infinity();
    bool is_on_surface = false;
    for (const std::int32_t f : surface.all) {
      if (geometry.is_degenerate(f)) continue;
      const double distance = (geometry.closest_point(f, x) - x).norm();
      if (distance > bullet::rounding_at(x))
        shortest = std::min(shortest, distance);
      else
        is_on_surface = true;
    }
    const bullet::FaceGrid::Nearest nearest = grid.nearest(x);
    CHECK((nearest.point - x).norm() == shortest);
    if (is_on_surface || shortest < 1e-3) continue;
    const double winding = bullet::winding_number(topology, surface.motion, surface.all, x);
    CHECK(grid.winding_number(x) == std::lround(winding));
    inside += winding > 0.5;
  }
  CHECK(inside > 100);
}
