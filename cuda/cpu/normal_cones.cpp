#include "cpu/normal_cones.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/vec.h"

namespace lazyccd {

const std::array<View, kViews> kViewTable = {{
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
    {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}},
    {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
    {{1, 1, 0}, {0, 0, 1}, {1, -1, 0}},
    {{1, -1, 0}, {1, 1, 0}, {0, 0, 1}},
    {{0, 1, 1}, {1, 0, 0}, {0, 1, -1}},
    {{0, 1, -1}, {0, 1, 1}, {1, 0, 0}},
    {{1, 0, 1}, {0, 1, 0}, {-1, 0, 1}},
    {{1, 0, -1}, {0, 1, 0}, {1, 0, 1}},
    {{1, 1, 1}, {1, -1, 0}, {0, 1, -1}},
    {{1, 1, -1}, {1, -1, 0}, {0, 1, 1}},
    {{1, -1, 1}, {1, 1, 0}, {0, 1, 1}},
    {{-1, 1, 1}, {1, 1, 0}, {0, 1, -1}},
}};

namespace {

// Larger patches are seldom flat, and the contour test is quadratic in the boundary.
constexpr std::int32_t kLargestPatch = 32;  // groups

using Point = Vec3<double>;

Point at(const VertexRecord& v, int end) {
  return {v.x[3 * end], v.x[3 * end + 1], v.x[3 * end + 2]};
}

double along(const std::array<int, 3>& direction, const Point& p) {
  return direction[0] * p.x + direction[1] * p.y + direction[2] * p.z;
}

double largest(const Point& p) {
  return std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
}

// The views along which the face has positive area, or negative, all the time: its normal
// e1(t) x e2(t) is a quadratic, whose Bernstein coefficients times the direction must have one
// sign.
//
// Rounding, in units of u = 2^-53 times E1 E2, the largest components over the step: a product of
// two rounded differences 3, a component of a cross product 8, of the mean of two of them 10, the
// product with a direction 3 * 10 + 12 = 42. So 64 bounds it; 2^-1000 covers underflow. A
// comparison with what is not a number is false, and then the face is in no view.
std::uint32_t views_of_face(const Face& face, const std::vector<VertexRecord>& vertices) {
  Point e1[2], e2[2];
  double size1 = 0, size2 = 0;
  for (int end = 0; end < 2; ++end) {
    const Point a = at(vertices[face[0]], end);
    e1[end] = at(vertices[face[1]], end) - a;
    e2[end] = at(vertices[face[2]], end) - a;
    size1 = std::max(size1, largest(e1[end]));
    size2 = std::max(size2, largest(e2[end]));
  }
  const Point normals[3] = {cross(e1[0], e2[0]), 0.5 * (cross(e1[0], e2[1]) + cross(e1[1], e2[0])),
                            cross(e1[1], e2[1])};
  const double error = 0x1p-47 * (size1 * size2) + 0x1p-1000;
  std::uint32_t views = 0;
  for (int i = 0; i < kViews; ++i) {
    double least = HUGE_VAL, most = -HUGE_VAL;
    bool ordered = true;
    for (const Point& n : normals) {
      const double area = along(kViewTable[i].along, n);
      ordered = ordered && area == area;
      least = std::min(least, area);
      most = std::max(most, area);
    }
    if (ordered && least > error) views |= 1u << i;
    if (ordered && most < -error) views |= 1u << (16 + i);
  }
  return views;
}

// The boundary of some faces as one loop of vertices; empty where it is not one loop, or where the
// faces are no oriented surface.
std::vector<std::int32_t> boundary_loop(const Mesh& mesh, const std::int32_t* faces,
                                        std::size_t count) {
  // Directed sides that have no opposite: by edge, the one face's direction.
  struct Side {
    std::int32_t from, to;
    int faces;
  };
  std::unordered_map<std::int32_t, Side> sides;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = mesh.faces()[faces[i]][k], to = mesh.faces()[faces[i]][(k + 1) % 3];
      Side& side =
          sides.try_emplace(mesh.face_edges()[faces[i]][k], Side{from, to, 0}).first->second;
      // A third face, or two that run along the edge in one direction.
      if (side.faces == 2 || (side.faces == 1 && side.from == from)) return {};
      ++side.faces;
    }
  }
  std::unordered_map<std::int32_t, std::int32_t> next;
  for (const auto& [edge, side] : sides)
    if (side.faces == 1 && !next.emplace(side.from, side.to).second) return {};
  std::vector<std::int32_t> loop;
  if (next.empty()) return loop;
  const std::int32_t first = next.begin()->first;
  std::int32_t at_vertex = first;
  do {
    loop.push_back(at_vertex);
    at_vertex = next.at(at_vertex);
  } while (at_vertex != first && loop.size() <= next.size());
  if (loop.size() != next.size()) loop.clear();
  return loop;
}

// The boundary as it is seen, at both ends of the step, in some directions of the plane.
class Contour {
 public:
  Contour(const View& view, const std::int32_t* loop, std::size_t count,
          const std::vector<VertexRecord>& vertices)
      : points_(count) {
    double size = 0;
    for (std::size_t i = 0; i < count; ++i) {
      for (int end = 0; end < 2; ++end) {
        const Point p = at(vertices[loop[i]], end);
        size = std::max(size, largest(p));
        const double u = along(view.u, p), w = along(view.w, p);
        double* s = points_[i].s[end];
        s[0] = u;
        s[1] = w;
        s[2] = u + w;
        s[3] = u - w;
      }
    }
    // Each of these is a sum of at most four coordinates, in three roundings of at most 4 u size.
    error_ = 0x1p-47 * size + 0x1p-1000;
  }

  // Whether two sides meet nowhere but in the vertex of neighbours.
  bool simple() const {
    const std::size_t n = points_.size();
    std::vector<Extent> extents(n);
    for (std::size_t i = 0; i < n; ++i) extents[i] = extent(points_[i], points_[(i + 1) % n]);
    for (std::size_t i = 0; i < n; ++i) {
      if (!turns(points_[i], points_[(i + 1) % n], points_[(i + 2) % n])) return false;
      const std::size_t end = i == 0 ? n - 1 : n;
      for (std::size_t j = i + 2; j < end; ++j)
        if (!apart(extents[i], extents[j])) return false;
    }
    return true;
  }

 private:
  static constexpr int kDirections = 4;
  struct Seen {
    double s[2][kDirections];
  };
  struct Extent {
    double lo[2][kDirections], hi[2][kDirections];
  };

  static Extent extent(const Seen& a, const Seen& b) {
    Extent e;
    for (int end = 0; end < 2; ++end) {
      for (int k = 0; k < kDirections; ++k) {
        e.lo[end][k] = std::min(a.s[end][k], b.s[end][k]);
        e.hi[end][k] = std::max(a.s[end][k], b.s[end][k]);
      }
    }
    return e;
  }

  // On the same side of each other in one direction at both ends, and so, the motion being linear,
  // all the time.
  bool apart(const Extent& a, const Extent& b) const {
    for (int k = 0; k < kDirections; ++k) {
      if (a.lo[0][k] - b.hi[0][k] > error_ && a.lo[1][k] - b.hi[1][k] > error_) return true;
      if (b.lo[0][k] - a.hi[0][k] > error_ && b.lo[1][k] - a.hi[1][k] > error_) return true;
    }
    return false;
  }

  // Whether the sides a-b and b-c never fold onto each other: both go forward in one direction all
  // the time, or they always turn to the same side.
  bool turns(const Seen& a, const Seen& b, const Seen& c) const {
    for (int k = 0; k < kDirections; ++k) {
      const double steps[4] = {b.s[0][k] - a.s[0][k], b.s[1][k] - a.s[1][k], c.s[0][k] - b.s[0][k],
                               c.s[1][k] - b.s[1][k]};
      const auto forward = [&](double step) { return step > error_; };
      const auto backward = [&](double step) { return step < -error_; };
      if (std::all_of(steps, steps + 4, forward) || std::all_of(steps, steps + 4, backward))
        return true;
    }
    // cross(t) is a quadratic: one sign of its Bernstein coefficients. Its factors are at most
    // `size` and off by error_ and a rounding, which is less; of four products that makes less
    // than 16.
    double p[2][2], q[2][2], size = 0;  // [end][coordinate] of b - a and c - b
    for (int end = 0; end < 2; ++end) {
      for (int k = 0; k < 2; ++k) {
        p[end][k] = b.s[end][k] - a.s[end][k];
        q[end][k] = c.s[end][k] - b.s[end][k];
        size = std::max({size, std::fabs(p[end][k]), std::fabs(q[end][k])});
      }
    }
    const auto area = [&](int i, int j) { return p[i][0] * q[j][1] - p[i][1] * q[j][0]; };
    const double areas[3] = {area(0, 0), 0.5 * (area(0, 1) + area(1, 0)), area(1, 1)};
    const double error = 16 * error_ * (size + error_) + 0x1p-1000;
    return std::all_of(areas, areas + 3, [&](double x) { return x > error; }) ||
           std::all_of(areas, areas + 3, [&](double x) { return x < -error; });
  }

  std::vector<Seen> points_;
  double error_ = 0;
};

}  // namespace

void NormalCones::build(const Mesh& mesh, const Groups& groups, const Tree& tree) {
  faces_.clear();
  first_face_.assign(1, 0);
  std::vector<char> has_edges_only;
  for (const std::int32_t g : tree.order()) {
    const Group& group = groups.groups()[g];
    const Block* block = groups.blocks().data() + group.first[kFaces];
    for (int i = 0; i < group.count[kFaces]; ++i)
      faces_.push_back(block[i / kBlockLanes].id[i % kBlockLanes]);
    first_face_.push_back(static_cast<std::uint32_t>(faces_.size()));
    has_edges_only.push_back(group.count[kFaces] == 0);
  }
  loops_.clear();
  loop_of_.assign(tree.nodes().size(), {});
  for (std::size_t node = 0; node < loop_of_.size(); ++node) {
    const Tree::Range range = tree.ranges()[node];
    if (range.last - range.first > kLargestPatch) continue;
    if (std::any_of(has_edges_only.begin() + range.first, has_edges_only.begin() + range.last,
                    [](char only) { return only != 0; }))
      continue;
    const std::uint32_t first = first_face_[range.first], last = first_face_[range.last];
    const auto loop = boundary_loop(mesh, faces_.data() + first, last - first);
    loop_of_[node] = {static_cast<std::uint32_t>(loops_.size()),
                      static_cast<std::uint32_t>(loop.size())};
    loops_.insert(loops_.end(), loop.begin(), loop.end());
  }
}

void NormalCones::refit(const Mesh& mesh, const Tree& tree,
                        const std::vector<VertexRecord>& vertices, ThreadPool& pool) {
  face_cones_.resize(faces_.size());
  pool.parallel_for(faces_.size(), 1024, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i)
      face_cones_[i] = views_of_face(mesh.faces()[faces_[i]], vertices);
  });
  cones_.resize(tree.nodes().size());
  for (std::size_t i = cones_.size(); i-- > 0;) {
    const TreeNode& node = tree.nodes()[i];
    if (!node.leaf()) {
      cones_[i] = cones_[node.left] & cones_[node.right];
      continue;
    }
    Directions all = ~Directions{0};
    const std::int32_t leaf = tree.ranges()[i].first;
    for (std::uint32_t f = first_face_[leaf]; f < first_face_[leaf + 1]; ++f) all &= face_cones_[f];
    cones_[i] = all;
  }
}

bool NormalCones::apart_from_itself(std::uint32_t node,
                                    const std::vector<VertexRecord>& vertices) const {
  const Loop loop = loop_of_[node];
  if (loop.count == 0 || cones_[node] == 0) return false;
  const Directions cone = (cones_[node] | cones_[node] >> 16) & 0xffff;
  for (int i = 0; i < kViews; ++i)
    if (cone >> i & 1)
      return Contour(kViewTable[i], loops_.data() + loop.first, loop.count, vertices).simple();
  return false;
}

std::size_t NormalCones::bytes() const {
  return (faces_.capacity() + loops_.capacity()) * sizeof(std::int32_t) +
         (first_face_.capacity() + face_cones_.capacity() + cones_.capacity()) *
             sizeof(std::uint32_t) +
         loop_of_.capacity() * sizeof(Loop);
}

}  // namespace lazyccd
