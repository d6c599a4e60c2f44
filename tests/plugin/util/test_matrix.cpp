#include "util/matrix.h"

#include "support/catch.h"

using namespace lazyccd::bullet;

namespace {

// Half of the distance from 1 to the next number: two of them count only if they are added first.
constexpr double tiny = 0x1p-53, one_and_both = 1 + 2 * tiny;

}  // namespace

TEST_CASE("sums have the order of Eigen's, so results have its bits") {
  Matrix3d rows = Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) rows.set_row(i, Vector3d(1, tiny, tiny).transpose());
  const Vector3d product = rows * Vector3d::Ones();
  CHECK(product.x() == 1);  // one term after another
  CHECK(product.y() == 1);
  CHECK(product.z() == one_and_both);  // by halves
  CHECK(Vector3d(1, tiny, tiny).dot(Vector3d::Ones()) == 1);
  CHECK(diagonal_matrix(Vector3d(1, tiny, tiny)).trace() == one_and_both);
  // Even and odd elements, by halves each.
  const Vector6d alternating = stacked(Vector3d(1, 0, tiny), Vector3d(0, tiny, 0));
  CHECK(alternating.dot(Vector6d::Ones()) == one_and_both);
  const Vector6d in_a_row = stacked(Vector3d(1, tiny, tiny), Vector3d(0, 0, 0));
  CHECK(in_a_row.sum() == 1);
}
