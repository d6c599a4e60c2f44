#include "research/volumes/dop18.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lazyccd::research {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kLargest = std::numeric_limits<float>::max();

// Rounds to the next float outward. That also covers the rounding of the sum in double. Values
// beyond the range of float are clamped to it, so two intervals beyond it on the same side always
// overlap.
float below(double x) {
  return std::nextafter(static_cast<float>(std::clamp(x, -kLargest, kLargest)), -kInfinity);
}
float above(double x) {
  return std::nextafter(static_cast<float>(std::clamp(x, -kLargest, kLargest)), kInfinity);
}

}  // namespace

void DiagonalSlabs::Slabs::clear() {
  std::fill(lo, lo + 8, kInfinity);
  std::fill(hi, hi + 8, -kInfinity);
}

void DiagonalSlabs::Slabs::add(const Slabs& other) {
  for (int i = 0; i < 8; ++i) {
    lo[i] = std::min(lo[i], other.lo[i]);
    hi[i] = std::max(hi[i], other.hi[i]);
  }
}

DiagonalSlabs::Slabs DiagonalSlabs::slabs_of(const VertexRecord& vertex, double margin) {
  double sums[2][kSlabs];
  for (int end = 0; end < 2; ++end) {
    const double x = vertex.x[3 * end], y = vertex.x[3 * end + 1], z = vertex.x[3 * end + 2];
    const double s[kSlabs] = {x + y, x - y, x + z, x - z, y + z, y - z};
    std::copy_n(s, kSlabs, sums[end]);
  }
  const double widening = 1.5 * margin;  // 1.5 > sqrt(2), the length of a diagonal such as x + y
  Slabs slabs;
  std::fill(slabs.lo, slabs.lo + 8, -kInfinity);
  std::fill(slabs.hi, slabs.hi + 8, kInfinity);
  for (int i = 0; i < kSlabs; ++i) {
    slabs.lo[i] = below(std::min(sums[0][i], sums[1][i]) - widening);
    slabs.hi[i] = above(std::max(sums[0][i], sums[1][i]) + widening);
  }
  return slabs;
}

void DiagonalSlabs::refit(const Groups& groups, const Tree& tree,
                          const std::vector<VertexRecord>& vertices, ThreadPool& pool) {
  vertices_.resize(vertices.size());
  pool.parallel_for(vertices.size(), 1024, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t v = first; v < last; ++v) vertices_[v] = slabs_of(vertices[v], margin_);
  });
  nodes_.resize(tree.nodes().size());
  tree.for_each_upward(pool, [&](std::size_t i) {
    const TreeNode& node = tree.nodes()[i];
    nodes_[i].clear();
    if (node.leaf()) {
      for_each_vertex(groups, groups.groups()[node.group()],
                      [&](std::int32_t v) { nodes_[i].add(vertices_[v]); });
    } else {
      nodes_[i].add(nodes_[node.left]);
      nodes_[i].add(nodes_[node.right()]);
    }
  });
}

bool DiagonalSlabs::apart(std::uint32_t a, std::uint32_t b) const {
  const Slabs &s = nodes_[a], &t = nodes_[b];
  bool apart = false;
  for (int i = 0; i < 8; ++i) apart |= (s.lo[i] > t.hi[i]) | (t.lo[i] > s.hi[i]);
  return apart;
}

std::size_t DiagonalSlabs::bytes() const {
  return (vertices_.capacity() + nodes_.capacity()) * sizeof(Slabs);
}

}  // namespace lazyccd::research
