#include "cpu/oriented_boxes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lazyccd {
namespace {

using Matrix = Eigen::Matrix3d;

// Slack of all bounds below, relative to the largest magnitude that takes part: they are sums of
// fewer than 100 products of numbers that are each off by a few roundings (2^-53), as the axes are
// from being orthonormal (the solver's residual, 2^-48 at the worst).
constexpr double kSlack = 0x1p-38;
constexpr double kTiny = 0x1p-1000;  // where they underflow

// Orthonormal axes, the rows of `axis`: the eigenvectors of the covariance, or those of the world
// where it has none in numbers.
void principal_axes(double count, const double* sum, const double* product, double (&axis)[3][3]) {
  const auto covariance = [&](int i, int j, int at) {
    return product[at] / count - (sum[i] / count) * (sum[j] / count);
  };
  Matrix m;
  m << covariance(0, 0, 0), covariance(0, 1, 1), covariance(0, 2, 2), covariance(0, 1, 1),
      covariance(1, 1, 3), covariance(1, 2, 4), covariance(0, 2, 2), covariance(1, 2, 4),
      covariance(2, 2, 5);
  Matrix axes = Matrix::Identity();
  if (m.allFinite()) {
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(m);
    if (solver.info() == Eigen::Success &&
        (solver.eigenvectors().transpose() * solver.eigenvectors() - Matrix::Identity())
                .cwiseAbs()
                .maxCoeff() < 0x1p-45)
      axes = solver.eigenvectors();
  }
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) axis[i][k] = axes(k, i);
}

double along(const double* axis, const double* x) {
  return axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2];
}

// The extent of points along three axes.
struct Extent {
  double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  double size = 0;  // largest magnitude of a coordinate

  void add(const double (&axis)[3][3], const double* x) {
    for (int i = 0; i < 3; ++i) {
      const double s = along(axis[i], x);
      lo[i] = std::min(lo[i], s);
      hi[i] = std::max(hi[i], s);
      size = std::max(size, std::fabs(x[i]));
    }
  }
};

template <class Box>
void close(const Extent& extent, double margin, Box& box) {
  double middle[3];
  for (int i = 0; i < 3; ++i) {
    middle[i] = 0.5 * extent.lo[i] + 0.5 * extent.hi[i];
    box.half[i] =
        0.5 * extent.hi[i] - 0.5 * extent.lo[i] + margin + kSlack * (extent.size + margin) + kTiny;
  }
  for (int k = 0; k < 3; ++k)
    box.centre[k] =
        middle[0] * box.axis[0][k] + middle[1] * box.axis[1][k] + middle[2] * box.axis[2][k];
}

}  // namespace

void OrientedBoxes::Moments::add(const double* x) {
  count += 1;
  for (int i = 0, at = 0; i < 3; ++i) {
    sum[i] += x[i];
    for (int j = i; j < 3; ++j) product[at++] += x[i] * x[j];
  }
}

void OrientedBoxes::Moments::add(const Moments& other) {
  count += other.count;
  for (int i = 0; i < 3; ++i) sum[i] += other.sum[i];
  for (int i = 0; i < 6; ++i) product[i] += other.product[i];
}

void OrientedBoxes::fit_leaf(const Groups& groups, const Group& group,
                             const std::vector<VertexRecord>& vertices, std::size_t node) {
  Moments& m = moments_[node];
  m = {};
  for_each_vertex(groups, group, [&](std::int32_t v) {
    m.add(vertices[v].x);
    m.add(vertices[v].x + 3);
  });
  Box& box = boxes_[node];
  principal_axes(m.count, m.sum, m.product, box.axis);
  Extent extent;
  for_each_vertex(groups, group, [&](std::int32_t v) {
    extent.add(box.axis, vertices[v].x);
    extent.add(box.axis, vertices[v].x + 3);
  });
  close(extent, margin_, box);
}

void OrientedBoxes::fit_parent(const TreeNode& node, std::size_t index) {
  Moments& m = moments_[index];
  m = moments_[node.left];
  m.add(moments_[node.right]);
  Box& box = boxes_[index];
  principal_axes(m.count, m.sum, m.product, box.axis);
  Extent extent;
  for (const std::int32_t child : {node.left, node.right}) {
    const Box& b = boxes_[child];
    for (int corner = 0; corner < 8; ++corner) {
      double x[3] = {b.centre[0], b.centre[1], b.centre[2]};
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          x[k] += (corner >> i & 1 ? b.half[i] : -b.half[i]) * b.axis[i][k];
      extent.add(box.axis, x);
    }
  }
  close(extent, 0, box);  // the children have the margin
}

void OrientedBoxes::refit(const Groups& groups, const Tree& tree,
                          const std::vector<VertexRecord>& vertices, ThreadPool& pool) {
  moments_.resize(tree.nodes().size());
  boxes_.resize(tree.nodes().size());
  pool.parallel_for(boxes_.size(), 64, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i)
      if (tree.nodes()[i].leaf())
        fit_leaf(groups, groups.groups()[tree.nodes()[i].group()], vertices, i);
  });
  for (std::size_t i = boxes_.size(); i-- > 0;)
    if (!tree.nodes()[i].leaf()) fit_parent(tree.nodes()[i], i);
}

// The separating axis test (Gottschalk et al. 1996): any direction that parts the boxes proves it,
// so none need be exact. A comparison with what is not a number is false.
bool OrientedBoxes::apart(std::uint32_t a, std::uint32_t b) const {
  const Box &s = boxes_[a], &t = boxes_[b];
  double between[3], size = 0;
  for (int k = 0; k < 3; ++k) {
    between[k] = t.centre[k] - s.centre[k];
    size = std::max({size, std::fabs(s.centre[k]) + s.half[k], std::fabs(t.centre[k]) + t.half[k]});
  }
  const double slack = 4 * kSlack * size + kTiny;
  double cosine[3][3], size_of[3][3];  // of axis i of s and axis j of t
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      cosine[i][j] = along(s.axis[i], t.axis[j]);
      size_of[i][j] = std::fabs(cosine[i][j]);
    }
  }
  double in_s[3], in_t[3];
  for (int i = 0; i < 3; ++i) {
    in_s[i] = along(s.axis[i], between);
    if (std::fabs(in_s[i]) > s.half[i] + along(size_of[i], t.half) + slack) return true;
  }
  for (int j = 0; j < 3; ++j) {
    in_t[j] = along(t.axis[j], between);
    const double column[3] = {size_of[0][j], size_of[1][j], size_of[2][j]};
    if (std::fabs(in_t[j]) > t.half[j] + along(column, s.half) + slack) return true;
  }
  // Along s_i x t_j, by the frame of s: its products with s_k and t_k are the cosines left over.
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const double distance = std::fabs(in_s[i2] * cosine[i1][j] - in_s[i1] * cosine[i2][j]);
      const double reach = s.half[i1] * size_of[i2][j] + s.half[i2] * size_of[i1][j] +
                           t.half[j1] * size_of[i][j2] + t.half[j2] * size_of[i][j1];
      if (distance > reach + slack) return true;
    }
  }
  return false;
}

std::size_t OrientedBoxes::bytes() const {
  return moments_.capacity() * sizeof(Moments) + boxes_.capacity() * sizeof(Box);
}

}  // namespace lazyccd
