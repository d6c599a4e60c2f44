#include "shapes/direction_grid.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

btVector3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto next = [&] { return static_cast<btScalar>(normal(random)); };
  const btScalar x = next(), y = next(), z = next();
  return btVector3(x, y, z).normalized();
}

}  // namespace

TEST_CASE("a direction grid lists every vector within its cosine") {
  std::mt19937 random(1);
  std::vector<btVector3> vectors;
  for (int i = 0; i < 500; ++i) vectors.push_back(random_direction(random));
  for (int axis = 0; axis < 3; ++axis) {
    btVector3 unit(0, 0, 0);
    unit[axis] = 1;
    vectors.push_back(unit);
    vectors.push_back(-unit);
  }
  for (const double min_cosine : {-1.0, 0.0, 0.7, 0.99, 1.0}) {
    const DirectionGrid grid(vectors, min_cosine);
    REQUIRE(grid.all().size() == vectors.size());
    std::vector<btVector3> directions = vectors;  // also those on the borders of cells
    for (int i = 0; i < 500; ++i) directions.push_back(random_direction(random));
    for (const btVector3& corner : {btVector3(1, 1, 1), btVector3(-1, 1, -1), btVector3(0, 1, -1)})
      directions.push_back(corner);
    for (const btVector3& direction : directions) {
      const Span<const std::int32_t> near = grid.near(direction);
      CHECK(std::is_sorted(near.begin(), near.end()));
      const btScalar length = direction.length();
      for (std::int32_t i = 0; i < static_cast<std::int32_t>(vectors.size()); ++i) {
        if (static_cast<double>(vectors[i].dot(direction) / length) < min_cosine) continue;
        if (std::binary_search(near.begin(), near.end(), i)) continue;
        CAPTURE(min_cosine, i, direction.x(), direction.y(), direction.z(),
                vectors[i].dot(direction));
        CAPTURE(vectors[i].x(), vectors[i].y(), vectors[i].z());
        FAIL("a vector is missing");
      }
    }
  }
}

TEST_CASE("a direction grid of an even sphere lists few vectors") {
  std::mt19937 random(2);
  std::vector<btVector3> vectors;
  for (int i = 0; i < 1000; ++i) vectors.push_back(random_direction(random));
  const DirectionGrid grid(vectors, std::cos(0.1));
  for (int i = 0; i < 100; ++i) CHECK(grid.near(random_direction(random)).size() < 100);
}

TEST_CASE("a direction grid of no vectors lists none") {
  CHECK(DirectionGrid({}, 0.5).near(btVector3(1, 0, 0)).size() == 0);
}
