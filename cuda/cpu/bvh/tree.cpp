#include "cpu/bvh/tree.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/bvh/morton.h"

namespace lazyccd {
namespace {

using CodedLeaf = std::pair<std::uint64_t, std::int32_t>;  // Morton code, group

std::vector<CodedLeaf> sorted_leaves(const std::vector<MotionBox>& leaves) {
  double lo[3], extent = 0;
  for (int k = 0; k < 3; ++k) {
    double lower = std::numeric_limits<double>::max(),
           upper = std::numeric_limits<double>::lowest();
    for (const MotionBox& b : leaves) {
      lower = std::min<double>(lower, b.lo0[k]);
      upper = std::max<double>(upper, b.hi0[k]);
    }
    lo[k] = lower;
    extent = std::max(extent, upper - lower);
  }
  const double scale = extent > 0 ? 1 / extent : 0;
  std::vector<CodedLeaf> coded(leaves.size());
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    double c[3];
    for (int k = 0; k < 3; ++k)
      c[k] = (0.5 * leaves[i].lo0[k] + 0.5 * leaves[i].hi0[k] - lo[k]) * scale;
    coded[i] = {morton_code(c[0], c[1], c[2]), static_cast<std::int32_t>(i)};
  }
  std::sort(coded.begin(), coded.end());
  return coded;
}

// Returns where to split [first, last): at the highest bit in which the codes differ, or in the
// middle if all codes are equal.
std::int32_t split(const std::vector<CodedLeaf>& leaves, std::int32_t first, std::int32_t last) {
  const std::uint64_t differing = leaves[first].first ^ leaves[last - 1].first;
  if (differing == 0) return first + (last - first) / 2;
  int top = 63;
  while (!(differing >> top & 1)) --top;
  const auto below = [&](const CodedLeaf& l) { return !(l.first >> top & 1); };
  return static_cast<std::int32_t>(
      std::partition_point(leaves.begin() + first, leaves.begin() + last, below) - leaves.begin());
}

}  // namespace

void Tree::build(const std::vector<MotionBox>& leaves) {
  nodes_.clear();
  order_.clear();
  ranges_.clear();
  if (leaves.empty()) return;
  const std::vector<CodedLeaf> coded = sorted_leaves(leaves);
  for (const CodedLeaf& leaf : coded) order_.push_back(leaf.second);
  nodes_.resize(2 * leaves.size() - 1);
  ranges_.resize(nodes_.size());
  ranges_[0] = {0, static_cast<std::int32_t>(coded.size())};
  std::vector<std::int32_t> open{0};
  std::int32_t used = 1;
  while (!open.empty()) {
    const std::int32_t at = open.back();
    open.pop_back();
    const Range r = ranges_[at];
    TreeNode& node = nodes_[at];
    if (r.last - r.first == 1) {
      node.left = -1 - order_[r.first];
      node.right = -1;
      continue;
    }
    const std::int32_t middle = split(coded, r.first, r.last);
    node.left = used++;
    node.right = used++;
    ranges_[node.left] = {r.first, middle};
    ranges_[node.right] = {middle, r.last};
    open.push_back(node.right);
    open.push_back(node.left);
  }
  refit(leaves);
}

void Tree::refit(const std::vector<MotionBox>& leaves) {
  double sum = 0, area = 0;
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    TreeNode& n = nodes_[i];
    double side[3];
    for (int k = 0; k < 3; ++k) {
      if (n.leaf()) {
        const MotionBox& b = leaves[n.group()];
        n.lo[k] = std::min(b.lo0[k], b.lo1[k]);
        n.hi[k] = std::max(b.hi0[k], b.hi1[k]);
      } else {
        n.lo[k] = std::min(nodes_[n.left].lo[k], nodes_[n.right].lo[k]);
        n.hi[k] = std::max(nodes_[n.left].hi[k], nodes_[n.right].hi[k]);
      }
      side[k] = static_cast<double>(n.hi[k]) - n.lo[k];
    }
    area = side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
    sum += area;
  }
  cost_ = area > 0 ? sum / area : 0;
}

}  // namespace lazyccd
