// Scenes of moving boxes with a tree, and the expected results of a traversal. Pairs of leaves are
// found by brute force. The front, the number of tests and the results of culling are found by a
// traversal on one thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/bvh/node_pair.h"
#include "core/bvh/tree.h"
#include "research/volumes/oriented_box.h"

namespace lazyccd::test {

using namespace research;

inline bool operator<(NodePair x, NodePair y) { return x.a != y.a ? x.a < y.a : x.b < y.b; }
inline bool operator==(NodePair x, NodePair y) { return x.a == y.a && x.b == y.b; }

inline NodePair in_order(std::int32_t a, std::int32_t b) {
  return {static_cast<std::uint32_t>(std::min(a, b)), static_cast<std::uint32_t>(std::max(a, b))};
}

inline void sort(std::vector<NodePair>& pairs) {
  std::sort(pairs.begin(), pairs.end(), [](NodePair x, NodePair y) { return x < y; });
}

/// Data for culling, per node. The box of a node encloses the boxes of its children.
struct NodeVolumes {
  std::vector<OrientedBoxOf<float>> boxes;
  std::vector<unsigned char> flat;
};

/// Result of a traversal on one thread.
struct Walk {
  std::vector<NodePair> front, leaf_pairs;  // sorted
  std::uint64_t tests = 0, culled_by_volume = 0, culled_by_normal_cone = 0;
};

inline Walk walk(const std::vector<TreeNode>& nodes, std::vector<NodePair> stack,
                 const NodeVolumes* volumes = nullptr) {
  Walk result;
  while (!stack.empty()) {
    const NodePair pair = stack.back();
    stack.pop_back();
    ++result.tests;
    const TreeNode &a = nodes[pair.a], &b = nodes[pair.b];
    PairVisit v = visit(pair, a, b);
    if (volumes && v.overlaps) {
      const bool flat = pair.a == pair.b && volumes->flat[pair.a] != 0;
      const bool parted = pair.a != pair.b && apart(volumes->boxes[pair.a], volumes->boxes[pair.b]);
      result.culled_by_normal_cone += flat;
      result.culled_by_volume += parted;
      if (flat || parted) v = {false, 0, {}};
    }
    for (int i = 0; i < v.children; ++i) stack.push_back(v.child[i]);
    if (v.children != 0) continue;
    result.front.push_back(pair);
    if (v.overlaps) result.leaf_pairs.push_back(in_order(a.group(), b.group()));
  }
  sort(result.front);
  sort(result.leaf_pairs);
  return result;
}

struct Frame {
  std::vector<TreeNode> nodes;
  std::vector<NodePair> leaf_pairs;  // pairs of groups, the smaller first, sorted
  Walk from_root, from_front;        // from_front: from the front that the frames before left
  NodeVolumes volumes;
  Walk culled_from_root, culled_from_front;
  std::vector<NodePair>
      queried_leaf_pairs;  // with culling, except of inner nodes paired with themselves
};

enum class Shape { balanced, left_chain, right_chain };

struct Scene {
  std::string name;
  std::uint32_t groups;
  float size;  // side of a box; the centres lie in a unit cube
  Shape shape = Shape::balanced;
  std::vector<Frame> frames;
};

class SceneMaker {
 public:
  explicit SceneMaker(Scene& scene) : scene_(scene), random_(scene.groups * 7919u + 1) {
    for (std::uint32_t g = 0; g < scene.groups; ++g) {
      std::vector<float> x(6);
      // A tenth of the boxes is crowded in a corner, so some queries take much longer.
      for (int k = 0; k < 3; ++k) x[k] = uniform(random_) * (g % 10 == 0 ? 0.1f : 1.f);
      for (int k = 3; k < 6; ++k) x[k] = 0.02f * (uniform(random_) - 0.5f);
      boxes_.push_back(x);
      order_.push_back(static_cast<std::int32_t>(g));
    }
    if (!order_.empty()) {
      tree_.resize(2 * order_.size() - 1);
      split(0, 0, static_cast<std::int32_t>(order_.size()), 0);
    }
  }

  void make(int frames) {
    std::vector<NodePair> front{{0, 0}}, culled_front{{0, 0}};
    for (int i = 0; i < frames; ++i) {
      Frame frame;
      refit();
      frame.nodes = tree_;
      frame.volumes = volumes();
      for (std::uint32_t a = 0; a < scene_.groups; ++a)
        for (std::uint32_t b = a; b < scene_.groups; ++b)
          if (overlap(leaf(a), leaf(b))) frame.leaf_pairs.push_back({a, b});
      if (!tree_.empty()) {
        frame.from_root = walk(tree_, {{0, 0}});
        frame.from_front = walk(tree_, front);
        front = frame.from_front.front;
        frame.culled_from_root = walk(tree_, {{0, 0}}, &frame.volumes);
        frame.culled_from_front = walk(tree_, culled_front, &frame.volumes);
        culled_front = frame.culled_from_front.front;
        frame.queried_leaf_pairs = queried_leaf_pairs(frame);
      }
      scene_.frames.push_back(std::move(frame));
      for (auto& x : boxes_)
        for (int k = 0; k < 3; ++k) x[k] += x[3 + k];
    }
  }

 private:
  TreeNode leaf(std::uint32_t g) const {
    TreeNode n{};
    const float half = scene_.size / 2;
    for (int k = 0; k < 3; ++k) {
      n.lo[k] = boxes_[g][k] - half;
      n.hi[k] = boxes_[g][k] + half;
    }
    return n;
  }

  // Boxes of 0.7 times the size of the leaves, and boxes that enclose them. A third of the nodes
  // are marked flat.
  NodeVolumes volumes() const {
    constexpr double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    NodeVolumes v;
    v.boxes.resize(tree_.size());
    std::vector<OrientedBox> boxes(tree_.size());
    for (std::size_t i = tree_.size(); i-- > 0;) {
      const TreeNode& n = tree_[i];
      AxesExtent extent;
      if (n.leaf()) {
        for (const float side : {-0.35f, 0.35f}) {
          double corner[3];
          for (int k = 0; k < 3; ++k) corner[k] = boxes_[n.group()][k] + side * scene_.size;
          extent.add(axis, corner);
        }
      } else {
        extent.add(axis, boxes[n.left]);
        extent.add(axis, boxes[n.right()]);
      }
      boxes[i] = enclose(axis, extent, 0);
      v.boxes[i] = rounded(boxes[i]);
    }
    for (std::size_t i = 0; i < tree_.size(); ++i) v.flat.push_back(i % 3 == 2);
    return v;
  }

  // Pairs of leaves that remain with culling if each leaf is a separate query.
  std::vector<NodePair> queried_leaf_pairs(const Frame& frame) const {
    std::vector<std::uint32_t> node_of(scene_.groups);
    for (std::uint32_t i = 0; i < tree_.size(); ++i)
      if (tree_[i].leaf()) node_of[tree_[i].group()] = i;
    std::vector<NodePair> pairs;
    for (const NodePair pair : frame.leaf_pairs) {
      const std::uint32_t a = node_of[pair.a], b = node_of[pair.b];
      if (a == b ? frame.volumes.flat[a] == 0
                 : !apart(frame.volumes.boxes[a], frame.volumes.boxes[b]))
        pairs.push_back(pair);
    }
    return pairs;
  }

  void split(std::int32_t at, std::int32_t first, std::int32_t last, int axis) {
    if (last - first == 1) {
      tree_[at].set_leaf(order_[first]);
      return;
    }
    std::int32_t middle = first + (last - first) / 2;
    if (scene_.shape == Shape::left_chain) middle = last - 1;
    if (scene_.shape == Shape::right_chain) middle = first + 1;
    if (scene_.shape == Shape::balanced)
      std::nth_element(
          order_.begin() + first, order_.begin() + middle, order_.begin() + last,
          [&](std::int32_t x, std::int32_t y) { return boxes_[x][axis] < boxes_[y][axis]; });
    const std::int32_t left = ++used_, right = ++used_;
    tree_[at].set_children(left, right, false);
    split(left, first, middle, (axis + 1) % 3);
    split(right, middle, last, (axis + 1) % 3);
  }

  void refit() {
    for (std::size_t i = tree_.size(); i-- > 0;) {
      TreeNode& n = tree_[i];
      if (n.leaf()) {
        const TreeNode box = leaf(static_cast<std::uint32_t>(n.group()));
        std::copy_n(box.lo, 3, n.lo);
        std::copy_n(box.hi, 3, n.hi);
        continue;
      }
      for (int k = 0; k < 3; ++k) {
        n.lo[k] = std::min(tree_[n.left].lo[k], tree_[n.right()].lo[k]);
        n.hi[k] = std::max(tree_[n.left].hi[k], tree_[n.right()].hi[k]);
      }
    }
  }

  Scene& scene_;
  std::mt19937 random_;
  std::uniform_real_distribution<float> uniform;
  std::vector<std::vector<float>> boxes_;  // centre, displacement per frame
  std::vector<std::int32_t> order_;
  std::vector<TreeNode> tree_;
  std::int32_t used_ = 0;
};

inline Scene make_scene(std::string name, std::uint32_t groups, float size, int frames,
                        Shape shape = Shape::balanced) {
  Scene scene{std::move(name), groups, size, shape, {}};
  SceneMaker(scene).make(frames);
  return scene;
}

}  // namespace lazyccd::test
