#include "motion/closest_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

Vector3d point_of(const std::array<double, 3>& weights, const std::array<Vector3d, 3>& corners) {
  return weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
}

// The least distance from x to points of a triangle, on a fine grid.
double least_distance(const Vector3d& x, const std::array<Vector3d, 3>& corners) {
  constexpr int steps = 60;
  double least = (x - corners[0]).norm();
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; i + j <= steps; ++j) {
      const double u = i / double(steps), v = j / double(steps);
      least = std::min(least, (x - point_of({1 - u - v, u, v}, corners)).norm());
    }
  }
  return least;
}

}  // namespace

TEST_CASE("the closest point of a triangle is found, also of one without area") {
  const Vector3d o(0, 0, 0), e(1, 0, 0), f(0, 1, 0), middle(0.5, 0, 0);
  const std::array<std::array<Vector3d, 3>, 8> triangles = {{{o, e, f},
                                                             {o, o, e},
                                                             {o, e, e},
                                                             {e, o, e},
                                                             {o, o, o},
                                                             {o, e, middle},
                                                             {middle, o, e},
                                                             {o, middle, e}}};
  for (const std::array<Vector3d, 3>& corners : triangles) {
    for (const double x : {-0.7, 0.2, 0.5, 1.6}) {
      for (const double y : {-0.4, 0.0, 0.3, 1.9}) {
        for (const double z : {0.0, 0.8}) {
          const Vector3d place(x, y, z);
          const std::array<double, 3> weights =
              closest_on_triangle(place, corners[0], corners[1], corners[2]);
          CHECK(is_inside(weights));
          CHECK(std::abs(weights[0] + weights[1] + weights[2] - 1) < 1e-12);
          const double distance = (place - point_of(weights, corners)).norm();
          CHECK(distance <= least_distance(place, corners) + 1e-12);
        }
      }
    }
  }
}
