// Tests of oriented boxes. The axes are orthonormal for all points, and principal if the points
// have principal directions. Two boxes are apart only if no points in them are in contact.
#include <array>
#include <cmath>
#include <vector>

#include "research/volumes/oriented_box.h"
#include "support/catch.h"
#include "support/generators.h"

using namespace lazyccd;
using namespace lazyccd::research;
using namespace lazyccd::test;

namespace {

using Point = std::array<double, 3>;

struct Fitted {
  double axis[3][3];
  OrientedBox box;
};

Fitted fit(const std::vector<Point>& points, double margin = 0) {
  Moments moments{};
  for (const Point& p : points) moments.add(p.data());
  Fitted f;
  principal_axes(moments, f.axis);
  AxesExtent extent;
  for (const Point& p : points) extent.add(f.axis, p.data());
  f.box = enclose(f.axis, extent, margin);
  return f;
}

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

bool orthonormal(const double (&axis)[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!(std::fabs(dot(axis[i], axis[j]) - (i == j)) < 0x1p-48)) return false;
  return true;
}

std::vector<Point> cloud(Random& random, const double (&sides)[3][3], const Point& centre) {
  std::vector<Point> points;
  for (int n = 0; n < 40; ++n) {
    Point p = centre;
    for (const auto& side : sides) {
      const double s = random.uniform(-1, 1);
      for (std::size_t k = 0; k < 3; ++k) p[k] += s * side[k];
    }
    points.push_back(p);
  }
  return points;
}

}  // namespace

TEST_CASE("the longest axis of a needle's box is the needle") {
  Random random(1);
  for (int n = 0; n < 200; ++n) {
    Point direction;
    for (double& d : direction) d = random.uniform(-1, 1);
    std::vector<Point> points;
    for (int i = -5; i <= 5; ++i)
      points.push_back({i * direction[0], 7 + i * direction[1], i * direction[2]});
    const Fitted f = fit(points);
    REQUIRE(orthonormal(f.axis));
    const double length = std::sqrt(dot(direction.data(), direction.data()));
    double most = 0, others = 0;
    for (int i = 0; i < 3; ++i) {
      const double share = std::fabs(dot(f.axis[i], direction.data())) / length;
      if (share > most) {
        others += most;
        most = share;
      } else {
        others += share;
      }
    }
    CHECK(most > 1 - 1e-6);
    CHECK(others < 2e-3);
  }
}

TEST_CASE("axes are orthonormal for points of any kind and size") {
  Random random(2);
  for (const double size : {1e-300, 1e-160, 1e-30, 1.0, 1e30, 1e150, 1e300}) {
    for (const double thin : {1.0, 1e-3, 1e-9, 0.0}) {
      double sides[3][3];
      for (int i = 0; i < 3; ++i)
        for (double& x : sides[i]) x = random.uniform(-1, 1) * size * (i == 0 ? 1 : thin);
      CHECK(orthonormal(fit(cloud(random, sides, {0, 0, 0})).axis));
      CHECK(orthonormal(fit(cloud(random, sides, {1e6 * size, 0, size})).axis));
    }
  }
  CHECK(orthonormal(fit({{3, 4, 5}}).axis));
  CHECK(orthonormal(fit({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).axis));
  CHECK(orthonormal(fit({}).axis));
}

TEST_CASE("a box is never apart from a box of some of its points or of boxes inside it") {
  Random random(3);
  int apart_count = 0;
  for (int n = 0; n < 300; ++n) {
    std::vector<Point> points[2];
    for (auto& some : points) {
      double sides[3][3];
      for (int i = 0; i < 3; ++i)
        for (double& x : sides[i]) x = random.uniform(-1, 1) * (i == 0 ? 1 : 0.05);
      some = cloud(random, sides, {random.uniform(-1, 1), random.uniform(-1, 1), 100});
    }
    const Fitted a = fit(points[0]), b = fit(points[1]);
    apart_count += apart(a.box, b.box);
    for (const Point& p : points[0]) CHECK_FALSE(apart(a.box, fit({p}).box));
    AxesExtent extent;
    extent.add(b.axis, a.box);
    extent.add(b.axis, b.box);
    const OrientedBox both = enclose(b.axis, extent, 0);
    CHECK_FALSE(apart(both, a.box));
    CHECK_FALSE(apart(both, b.box));
    for (const Point& p : points[0]) CHECK_FALSE(apart(both, fit({p}).box));
  }
  CHECK(apart_count > 50);
}

TEST_CASE("a box in single precision is never apart from one of some of its points") {
  Random random(4);
  int apart_count = 0, apart_in_double = 0;
  for (const double size : {1e-30, 1.0, 1e30}) {
    for (const double offset : {0.0, 10.0, 1e6}) {
      for (int n = 0; n < 20; ++n) {
        OrientedBox boxes[2];
        for (OrientedBox& box : boxes) {
          double sides[3][3];
          for (int i = 0; i < 3; ++i)
            for (double& x : sides[i]) x = size * random.uniform(-1, 1) * (i == 0 ? 1 : 0.05);
          Point centre;
          for (double& c : centre) c = size * (offset + random.uniform(-0.5, 0.5));
          const std::vector<Point> points = cloud(random, sides, centre);
          box = fit(points).box;
          for (const Point& p : points) {
            CHECK_FALSE(apart(rounded(box), rounded(fit({p}).box)));
            CHECK_FALSE(apart(rounded(fit({p}).box), rounded(box)));
          }
        }
        const bool in_double = apart(boxes[0], boxes[1]);
        const bool in_single = apart(rounded(boxes[0]), rounded(boxes[1]));
        if (in_single) CHECK(in_double);
        apart_count += in_single;
        apart_in_double += in_double;
      }
    }
  }
  CHECK(apart_count > 0.6 * apart_in_double);  // low resolution far from the origin
}

TEST_CASE("a box with a NaN is apart from no box") {
  const Fitted good = fit({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  for (const double bad : {HUGE_VAL, -HUGE_VAL, std::nan("")}) {
    const Fitted f = fit({{5, 5, bad}, {6, 6, 6}});
    CHECK_FALSE(apart(f.box, good.box));
    CHECK_FALSE(apart(good.box, f.box));
    CHECK_FALSE(apart(rounded(good.box), rounded(f.box)));
    AxesExtent extent;
    extent.add(good.axis, f.box);
    extent.add(good.axis, fit({{9, 9, 9}}).box);
    CHECK_FALSE(apart(enclose(good.axis, extent, 0), good.box));
  }
}
