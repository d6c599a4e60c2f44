#include "random/soft_bodies.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <set>
#include <vector>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::test {
namespace {

using scenes::vector;

using Body = std::unique_ptr<btSoftBody>;

// Makes a body of triangles, with a link for each edge.
Body body_of(btSoftBodyWorldInfo& info, const std::vector<btVector3>& points,
             const std::vector<std::array<int, 3>>& faces) {
  auto body =
      std::make_unique<btSoftBody>(&info, static_cast<int>(points.size()), points.data(), nullptr);
  body->appendMaterial();
  std::set<std::array<int, 2>> sides;
  for (const std::array<int, 3>& face : faces) {
    body->appendFace(face[0], face[1], face[2]);
    for (int k = 0; k < 3; ++k) {
      const int a = face[k], b = face[(k + 1) % 3];
      sides.insert({std::min(a, b), std::max(a, b)});
    }
  }
  for (const std::array<int, 2>& side : sides) body->appendLink(side[0], side[1]);
  return body;
}

Body cloth(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const int columns = 2 + random.below(10), rows = 2 + random.below(10);
  const double stretch = random.across_scales(0.2, 1), wave = random.uniform(0, 0.15);
  const double jitter = random.uniform(0, 0.1) / std::max(columns, rows);
  return scenes::make_cloth(info, columns, rows, 1, [&](double u, double v) {
    const btVector3 off = random.in_cube(jitter * size);
    return off + vector((u - 0.5) * size, wave * size * std::sin(6 * u) * std::cos(5 * v),
                        (v - 0.5) * size * stretch);
  });
}

Body patch(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const double h = size / 2;
  return Body(btSoftBodyHelpers::CreatePatch(info, vector(-h, 0, -h), vector(h, 0, -h),
                                             vector(-h, 0, h), vector(h, 0, h), 2 + random.below(9),
                                             2 + random.below(9), 0, random.chance(0.5)));
}

Body ellipsoid(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const double r = size / 2;
  return Body(btSoftBodyHelpers::CreateEllipsoid(
      info, vector(0, 0, 0), vector(r, r * random.uniform(0.3, 1), r * random.uniform(0.3, 1)),
      20 + random.below(120)));
}

Body hull(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  std::vector<btVector3> points;
  for (int i = 8 + random.below(40); i > 0; --i)
    points.push_back(static_cast<btScalar>(size / 2) * random.direction());
  return Body(btSoftBodyHelpers::CreateFromConvexHull(
      info, points.data(), static_cast<int>(points.size()), random.chance(0.5)));
}

// A closed tube: a torus.
Body torus(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const int around = 5 + random.below(10), across = 3 + random.below(5);
  const double ring = 0.36 * size, tube = random.uniform(0.05, 0.14) * size;
  std::vector<btScalar> points;
  std::vector<int> faces;
  for (int i = 0; i < around; ++i) {
    for (int k = 0; k < across; ++k) {
      const double a = 2 * 3.14159265358979 * i / around, b = 2 * 3.14159265358979 * k / across;
      const double r = ring + tube * std::cos(b);
      for (const double x : {r * std::cos(a), tube * std::sin(b), r * std::sin(a)})
        points.push_back(static_cast<btScalar>(x));
      const int i1 = (i + 1) % around, k1 = (k + 1) % across;
      const int p = i * across + k, q = i1 * across + k, r0 = i1 * across + k1, s = i * across + k1;
      for (const int corner : {p, q, r0, p, r0, s}) faces.push_back(corner);
    }
  }
  return Body(btSoftBodyHelpers::CreateFromTriMesh(
      info, points.data(), faces.data(), static_cast<int>(faces.size() / 3), random.chance(0.5)));
}

Body triangle(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const double thin = random.across_scales(1e-3, 1);
  return body_of(info, {vector(-size / 2, 0, 0), vector(size / 2, 0, 0), vector(0, 0, thin * size)},
                 {{0, 1, 2}});
}

// Three to six sheets that share one side, as the pages of a book do: non-manifold edges.
Body fan(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const int blades = 3 + random.below(4), rows = 2 + random.below(4);
  std::vector<btVector3> points;
  std::vector<std::array<int, 3>> faces;
  for (int row = 0; row <= rows; ++row)
    points.push_back(vector(0, (row / double(rows) - 0.5) * size, 0));
  for (int blade = 0; blade < blades; ++blade) {
    const int first = static_cast<int>(points.size());
    const double a = 2 * 3.14159265358979 * blade / blades + 0.1;
    for (int row = 0; row <= rows; ++row)
      points.push_back(vector(0.5 * size * std::cos(a), (row / double(rows) - 0.5) * size,
                              0.5 * size * std::sin(a)));
    for (int row = 0; row < rows; ++row) {
      faces.push_back({row, row + 1, first + row + 1});
      faces.push_back({row, first + row + 1, first + row});
    }
  }
  return body_of(info, points, faces);
}

// Separate triangles of very different sizes in one body.
Body shards(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  std::vector<btVector3> points;
  std::vector<std::array<int, 3>> faces;
  const int count = 2 + random.below(8);
  for (int i = 0; i < count; ++i) {
    const double width = random.across_scales(0.002, 0.8) * size;
    const btVector3 at(0, static_cast<btScalar>((i / double(count) - 0.5) * size), 0);
    const int first = static_cast<int>(points.size());
    points.push_back(at);
    points.push_back(at + vector(width, 0, 0.1 * width));
    points.push_back(at + vector(0.2 * width, 0, random.across_scales(0.01, 1) * width));
    faces.push_back({first, first + 1, first + 2});
  }
  return body_of(info, points, faces);
}

Body rope(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const btVector3 end = vector(size / 2, 0, 0);
  if (random.chance(0.5)) return scenes::make_rope(info, 2 + random.below(20), 1, -end, end);
  const int pinned = random.chance(0.6) ? 0 : 1 + random.below(3);
  return Body(btSoftBodyHelpers::CreateRope(info, -end, end, 1 + random.below(20), pinned));
}

// A square grid of links without faces.
Body net(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  const int n = 3 + random.below(7);
  std::vector<btVector3> points;
  for (int i = 0; i < n * n; ++i)
    points.push_back(vector((i % n / (n - 1.0) - 0.5) * size, 0, (i / n / (n - 1.0) - 0.5) * size));
  auto body = std::make_unique<btSoftBody>(&info, n * n, points.data(), nullptr);
  body->appendMaterial();
  for (int i = 0; i < n * n; ++i) {
    if (i % n + 1 < n) body->appendLink(i, i + 1);
    if (i + n < n * n) body->appendLink(i, i + n);
  }
  return body;
}

Body solid(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  if (random.chance(0.5))
    return scenes::make_ball(info, 2 + random.below(3), 1, btVector3(0, 0, 0), size / 2);
  const double depth = random.uniform(0.2, 1);
  return scenes::make_solid(info, 1 + random.below(3), 1, [&](double u, double v, double w) {
    return vector((u - 0.5) * size, (v - 0.5) * depth * size, (w - 0.5) * depth * size);
  });
}

}  // namespace

SoftBody sleeve(btSoftBodyWorldInfo& info, const btVector3& inner, RandomSource& random) {
  const int around = 6 + random.below(12), rows = 2 + random.below(5);
  const double slack = random.uniform(1.02, 1.5) / std::cos(3.14159265358979 / around);
  const double radius = slack * static_cast<double>(btVector3(0, inner.y(), inner.z()).length());
  const double half = random.uniform(0.3, 1.2) * static_cast<double>(inner.x());
  std::vector<btVector3> points;
  std::vector<std::array<int, 3>> faces;
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < around; ++i) {
      const double a = 2 * 3.14159265358979 * i / around;
      points.push_back(
          vector((2.0 * row / (rows - 1) - 1) * half, radius * std::cos(a), radius * std::sin(a)));
      if (row == 0) continue;
      const int p = row * around + i, q = row * around + (i + 1) % around;
      faces.push_back({p, q, q - around});
      faces.push_back({p, q - around, p - around});
    }
  }
  return {body_of(info, points, faces), "sleeve"};
}

SoftBody random_rope(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  return {rope(info, size, random), "rope"};
}

SoftBody random_soft_body(btSoftBodyWorldInfo& info, double size, RandomSource& random) {
  switch (random.below(13)) {
    case 0:
    case 1:
    case 2:
      return {cloth(info, size, random), "cloth"};
    case 3:
      return {patch(info, size, random), "patch"};
    case 4:
      return {ellipsoid(info, size, random), "ellipsoid"};
    case 5:
      return {hull(info, size, random), "hull"};
    case 6:
      return {torus(info, size, random), "torus"};
    case 7:
      return {fan(info, size, random), "fan"};
    case 8:
      return {shards(info, size, random), "shards"};
    case 9:
      if (random.chance(0.4)) return {net(info, size, random), "net"};
      return random_rope(info, size, random);
    case 10:
      return {random.chance(0.3) ? triangle(info, size, random) : shards(info, size, random),
              "shards"};
    default:
      return {solid(info, size, random), "solid"};
  }
}

}  // namespace lazyccd::test
