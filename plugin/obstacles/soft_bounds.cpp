#include "obstacles/soft_bounds.h"

#include <algorithm>
#include <numeric>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr std::ptrdiff_t block_size = 32;

// Bits of a vertex's mark. The first six are those of beyond().
constexpr std::uint8_t all_sides = 63, is_known = 64, is_near = 128;

// Sorts items such that each run of a block's size has neighbours: halves them at the median of
// their longest extent, again and again. Each half but the last is a whole number of blocks.
template <class Iterator, class Middle>
void sort_into_blocks(Iterator first, Iterator last, const Middle& middle_of) {
  if (last - first <= block_size) return;
  MotionBounds bounds;
  std::for_each(first, last, [&](std::int32_t item) { bounds.add(middle_of(item)); });
  int axis;
  (bounds.upper - bounds.lower).maxCoeff(&axis);
  const std::ptrdiff_t blocks = (last - first + block_size - 1) / block_size;
  const Iterator half = first + blocks / 2 * block_size;
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
    const auto last = std::min<std::int32_t>(first + block_size, size_of(sorted));
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
    body.marks.assign(static_cast<std::size_t>(soft.vertex_count), 0);
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

// A bit for each side of finite bounds beyond which a vertex stays, farther away than the distance.
// A vertex that is not finite has none.
std::uint8_t SoftBounds::beyond(std::int32_t vertex, const Other& other, bool is_finite) const {
  const Vector3d x0 = motion_.start_of(vertex), x1 = at_start_ ? x0 : motion_.end_of(vertex);
  if (!is_finite && !(x0 + x1).allFinite()) return 0;
  unsigned sides = 0;
  for (int k = 0; k < 3; ++k) {
    const double least = std::min(x0[k], x1[k]), most = std::max(x0[k], x1[k]);
    sides |= static_cast<unsigned>(least - other.bounds.upper[k] > other.distance) << (2 * k);
    sides |= static_cast<unsigned>(other.bounds.lower[k] - most > other.distance) << (2 * k + 1);
  }
  return static_cast<std::uint8_t>(sides);
}

// A primitive is apart from the bounds if all of its vertices are beyond the same side.
template <class Primitives>
void SoftBounds::add_near(const Primitives& primitives, const Blocks& all, const Other& other,
                          std::int32_t first_vertex, std::vector<std::uint8_t>& marks,
                          std::vector<std::int32_t>& near) {
  const auto mark_of = [&](std::int32_t v) -> std::uint8_t& {
    return marks[static_cast<std::size_t>(v - first_vertex)];
  };
  for (const Block& block : all.blocks) {
    if (are_apart(block.bounds, other.bounds, other.distance)) continue;
    const bool is_finite = block.bounds.is_finite(), other_is_finite = other.bounds.is_finite();
    for (std::int32_t i = block.vertices.first; i < block.vertices.last; ++i) {
      const std::int32_t v = all.vertices[static_cast<std::size_t>(i)];
      if (mark_of(v) & is_known) continue;
      mark_of(v) = is_known | (other_is_finite ? beyond(v, other, is_finite) : std::uint8_t{0});
    }
    for (std::int32_t i = block.primitives.first; i < block.primitives.last; ++i) {
      const std::int32_t index = all.primitives[static_cast<std::size_t>(i)];
      const auto& primitive = primitives[static_cast<std::size_t>(index)];
      std::uint8_t common = all_sides;
      for (const std::int32_t v : primitive) common &= mark_of(v);
      if (common != 0) continue;
      near.push_back(index);
      for (const std::int32_t v : primitive) mark_of(v) |= is_near;
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
  const Topology topology = topology_.topology();
  add_near(topology.edges, body.edges, {other, distance}, soft.first_vertex, body.marks,
           near_.edges);
  add_near(topology.faces, body.faces, {other, distance}, soft.first_vertex, body.marks,
           near_.faces);
  std::int32_t vertex = soft.first_vertex;
  for (std::uint8_t& mark : body.marks) {
    if (mark & is_near) near_.vertices.push_back(vertex);
    mark = 0;
    ++vertex;
  }
  return near_;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
