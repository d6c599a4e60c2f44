#include "host/bvh/tree.h"

#include <algorithm>
#include <atomic>

namespace lazyccd {
namespace {

// Leaves of a part. It does not depend on the threads, so that sums over the parts do not either.
constexpr std::int32_t kPart = 512;
constexpr std::size_t kGrain = 1 << 12;  // leaves that a thread takes at a time

// Computes the box of a node from its children, or from its group.
void fit(TreeNode& n, const TreeNode* nodes, const MotionBox* leaves) {
  for (int k = 0; k < 3; ++k) {
    if (n.leaf()) {
      const MotionBox& b = leaves[n.group()];
      n.lo[k] = std::min(b.lo0[k], b.lo1[k]);
      n.hi[k] = std::max(b.hi0[k], b.hi1[k]);
    } else {
      n.lo[k] = std::min(nodes[n.left].lo[k], nodes[n.right()].lo[k]);
      n.hi[k] = std::max(nodes[n.left].hi[k], nodes[n.right()].hi[k]);
    }
  }
}

// Returns half of the area of a node's box.
double half_area(const TreeNode& n) {
  double side[3];
  for (int k = 0; k < 3; ++k) side[k] = static_cast<double>(n.hi[k]) - n.lo[k];
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

}  // namespace

void Tree::sort_leaves(const NoinitVector<std::uint64_t>& codes, Span<const std::int32_t> worlds,
                       ThreadPool& pool) {
  order_.resize(codes.size());
  codes_.resize(codes.size());
  std::atomic<bool> ascending{true};  // relaxed: the end of the job orders the stores
  pool.parallel_for(codes.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      order_[i] = static_cast<std::int32_t>(i);
      codes_[i] = codes[i];
      if (i > 0 && codes[i] < codes[i - 1] && (worlds.empty() || worlds[i] == worlds[i - 1]))
        ascending.store(false, std::memory_order_relaxed);
    }
  });
  if (ascending.load(std::memory_order_relaxed)) return;  // the groups of one segment
  sort_.items.resize(codes.size());
  pool.parallel_for(codes.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i)
      sort_.items[i] = {codes[i], static_cast<std::int32_t>(i)};
  });
  std::vector<std::size_t> begins{0};  // of the worlds
  for (std::size_t i = 1; i < worlds.size(); ++i)
    if (worlds[i] != worlds[i - 1]) begins.push_back(i);
  begins.push_back(codes.size());
  sort_.sort_parts(begins.size() - 1, pool, [&](std::size_t i) -> KeySort::Part {
    return {begins[i], begins[i + 1]};
  });
  pool.parallel_for(codes.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      order_[i] = sort_.items[i].index;
      codes_[i] = sort_.items[i].key;
    }
  });
}

template <class Small, class Opened>
void Tree::open(std::int32_t node, std::int32_t first_below, std::int32_t size, Small&& small,
                Opened&& opened) {
  const LeafCodes codes{codes_.data(), static_cast<std::int32_t>(codes_.size()),
                        worlds_.empty() ? nullptr : worlds_.data()};
  struct Closed {
    std::int32_t node, first_below;
  };
  Closed stack[129];  // the tree is not deeper than its keys have bits: 32 + 64 + 31
  int height = 0;
  stack[height++] = {node, first_below};
  while (height > 0) {
    const Closed at = stack[--height];
    const Range r = ranges_[at.node];
    TreeNode& n = nodes_[at.node];
    if (r.last - r.first == 1) n.set_leaf(order_[r.first]);
    if (r.last - r.first <= size) {
      small(at.node, at.first_below);
      continue;
    }
    opened(at.node);
    const std::int32_t middle = codes.split(r.first, r.last);
    const std::int32_t left = at.first_below, right = at.first_below + 1;
    n.set_children(left, right, codes.separates_worlds(middle));
    ranges_[left] = {r.first, middle};
    ranges_[right] = {middle, r.last};
    // Below the left child come 2 (middle - first) - 2 nodes.
    const std::int32_t below_left = at.first_below + 2;
    stack[height++] = {right, below_left + 2 * (middle - r.first) - 2};
    stack[height++] = {left, below_left};
  }
}

void Tree::build(const NoinitVector<std::uint64_t>& codes, const NoinitVector<MotionBox>& leaves,
                 ThreadPool& pool, Span<const std::int32_t> worlds) {
  nodes_.clear();
  order_.clear();
  ranges_.clear();
  parts_.clear();
  top_.clear();
  if (leaves.empty()) return;
  sort_leaves(codes, worlds, pool);
  worlds_ = worlds;  // by leaf too: groups and leaves are in order of the worlds
  nodes_.resize(2 * leaves.size() - 1);
  ranges_.resize(nodes_.size());
  const auto count = static_cast<std::int32_t>(leaves.size());
  ranges_[0] = {0, count};
  open(
      0, 1, kPart,
      [&](std::int32_t node, std::int32_t first_below) {
        const Range r = ranges_[node];
        parts_.push_back({node, first_below, first_below + 2 * (r.last - r.first) - 2});
      },
      [&](std::int32_t node) { top_.push_back(node); });
  pool.parallel_for(parts_.size(), 1, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t p = first; p < last; ++p)
      open(
          parts_[p].root, parts_[p].first_below, 1, [](std::int32_t, std::int32_t) {},
          [](std::int32_t) {});
  });
  worlds_ = {};
  refit(leaves, pool);
}

void Tree::refit(const NoinitVector<MotionBox>& leaves, ThreadPool& pool) {
  if (nodes_.empty()) return;
  const auto fit_node = [&](std::size_t i) {
    fit(nodes_[i], nodes_.data(), leaves.data());
    return half_area(nodes_[i]);
  };
  areas_.resize(parts_.size());
  pool.parallel_for(parts_.size(), 1, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t p = first; p < last; ++p) {
      areas_[p] = 0;
      parts_[p].for_each_upward([&](std::size_t i) { areas_[p] += fit_node(i); });
    }
  });
  double sum = 0;
  for (const double of_part : areas_) sum += of_part;
  for (std::size_t i = top_.size(); i-- > 0;) sum += fit_node(static_cast<std::size_t>(top_[i]));
  const double root = half_area(nodes_[0]);
  cost_ = root > 0 ? sum / root : 0;
}

std::size_t Tree::bytes() const {
  return sort_.bytes() + codes_.capacity() * sizeof(std::uint64_t) +
         nodes_.capacity() * sizeof(TreeNode) + order_.capacity() * sizeof(std::int32_t) +
         ranges_.capacity() * sizeof(Range) + parts_.capacity() * sizeof(Part) +
         top_.capacity() * sizeof(std::int32_t) + areas_.capacity() * sizeof(double);
}

}  // namespace lazyccd
