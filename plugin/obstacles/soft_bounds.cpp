#include "obstacles/soft_bounds.h"

#include <algorithm>
#include <numeric>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

constexpr std::ptrdiff_t primitives_a_block = 32;

// Sorts items such that each run of a block's size has neighbours: halves them at the median of
// their longest extent, again and again. Each half but the last is a whole number of blocks.
template <class Iterator, class Middle>
void sort_into_blocks(Iterator first, Iterator last, const Middle& middle_of) {
  if (last - first <= primitives_a_block) return;
  MotionBounds bounds;
  std::for_each(first, last, [&](std::int32_t item) { bounds.add(middle_of(item)); });
  Eigen::Index axis;
  (bounds.upper - bounds.lower).maxCoeff(&axis);
  const std::ptrdiff_t blocks = (last - first + primitives_a_block - 1) / primitives_a_block;
  const Iterator half = first + blocks / 2 * primitives_a_block;
  std::nth_element(first, half, last, [&](std::int32_t a, std::int32_t b) {
    const double x = middle_of(a)[axis], y = middle_of(b)[axis];
    return x < y || (x == y && a < b);
  });
  sort_into_blocks(first, half, middle_of);
  sort_into_blocks(half, last, middle_of);
}

}  // namespace

void SoftBounds::begin(bool at_start) {
  at_start_ = at_start;
  for (BodyBounds& body : bodies_) body.is_current = false;
}

template <class Primitives>
void SoftBounds::make_blocks(const Primitives& primitives, const IndexRange& range,
                             Blocks& result) const {
  std::vector<std::int32_t>& sorted = result.primitives;
  sorted.resize(static_cast<std::size_t>(range.last - range.first));
  std::iota(sorted.begin(), sorted.end(), range.first);
  const auto all_finite = [this](const auto& primitive) {
    return std::all_of(primitive.begin(), primitive.end(),
                       [this](std::int32_t v) { return motion_.start_of(v).allFinite(); });
  };
  // What is not finite has no order.
  if (std::all_of(primitives.begin() + range.first, primitives.begin() + range.last, all_finite))
    sort_into_blocks(sorted.begin(), sorted.end(), [&](std::int32_t i) {
      Vector3d sum = Vector3d::Zero();
      for (const std::int32_t v : primitives[static_cast<std::size_t>(i)])
        sum += motion_.start_of(v);
      return sum;
    });
  const auto size_of = [](const auto& list) { return static_cast<std::int32_t>(list.size()); };
  for (std::int32_t first = 0; first < size_of(sorted);) {
    const auto last = std::min<std::int32_t>(first + primitives_a_block, size_of(sorted));
    const std::int32_t first_vertex = size_of(result.vertices);
    for (std::int32_t i = first; i < last; ++i)
      for (const std::int32_t v : primitives[static_cast<std::size_t>(sorted[i])])
        result.vertices.push_back(v);
    const auto begin = result.vertices.begin() + first_vertex;
    std::sort(begin, result.vertices.end());
    result.vertices.erase(std::unique(begin, result.vertices.end()), result.vertices.end());
    result.blocks.push_back({{first, last}, {first_vertex, size_of(result.vertices)}, {}});
    first = last;
  }
}

void SoftBounds::update(const StepTopology::BodyRecord& soft, BodyBounds& body) const {
  if (!body.has_blocks) {
    const Topology topology = topology_.topology();
    make_blocks(topology.edges, soft.edges, body.edges);
    make_blocks(topology.faces, soft.faces, body.faces);
    body.is_near.assign(static_cast<std::size_t>(soft.vertex_count), 0);
    body.has_blocks = true;
  }
  body.all = MotionBounds();
  for (Blocks* const all : {&body.edges, &body.faces}) {
    for (Block& block : all->blocks) {
      block.bounds = MotionBounds();
      for (std::int32_t i = block.vertices.first; i < block.vertices.last; ++i) {
        const std::int32_t v = all->vertices[static_cast<std::size_t>(i)];
        block.bounds.add(motion_.start_of(v));
        if (!at_start_) block.bounds.add(motion_.end_of(v));
      }
      body.all.add(block.bounds);
    }
  }
  body.is_current = true;
}

void SoftBounds::add_near(const Blocks& all, const MotionBounds& other, double distance,
                          std::int32_t first_vertex, std::vector<char>& is_near,
                          std::vector<std::int32_t>& primitives) {
  for (const Block& block : all.blocks) {
    if (are_apart(block.bounds, other, distance)) continue;
    primitives.insert(primitives.end(), all.primitives.begin() + block.primitives.first,
                      all.primitives.begin() + block.primitives.last);
    for (std::int32_t i = block.vertices.first; i < block.vertices.last; ++i) {
      const std::int32_t v = all.vertices[static_cast<std::size_t>(i)];
      char& is_known = is_near[static_cast<std::size_t>(v - first_vertex)];
      if (!is_known) near_.vertices.push_back(v);
      is_known = 1;
    }
  }
}

const NearPrimitives& SoftBounds::find_near(std::int32_t soft_body, const MotionBounds& other,
                                            double distance) {
  const StepTopology::BodyRecord& soft = topology_.bodies()[soft_body];
  BodyBounds& body = bodies_[static_cast<std::size_t>(soft_body)];
  if (!body.is_current) update(soft, body);
  near_.vertices.clear();
  near_.edges.clear();
  near_.faces.clear();
  if (are_apart(body.all, other, distance)) return near_;
  add_near(body.edges, other, distance, soft.first_vertex, body.is_near, near_.edges);
  add_near(body.faces, other, distance, soft.first_vertex, body.is_near, near_.faces);
  for (const std::int32_t v : near_.vertices)
    body.is_near[static_cast<std::size_t>(v - soft.first_vertex)] = 0;
  return near_;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
