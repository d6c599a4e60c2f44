#include "touching/touching_starts.h"

#include <algorithm>
#include <cmath>

#include "motion/rounding.h"
#include "settings.h"
#include "touching/touching_sides.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// By vertex, by axis: what bounds the rounding of its position (rounding.h), metres.
std::vector<Vector3d> find_extents(const StepTopology& topology, const Motion& motion) {
  std::vector<Vector3d> extents(motion.size());
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(extents.size()); ++v) {
    const int rigid = motion.rigid_of_body()[topology.body_of(v)];
    extents[v] = motion.start_of(v).cwiseAbs();
    if (rigid >= 0) extents[v] += motion.rigid()[rigid].centre().cwiseAbs();
  }
  return extents;
}

// Distance along `normal` that rounding cannot tell from zero, metres. Positive also where all
// coordinates are zero.
double bound_of(const TouchingPair& pair, const Vector3d& normal,
                const std::vector<Vector3d>& extents, const Motion& motion) {
  Vector3d extent = Vector3d::Zero();
  for (const std::int32_t v : pair.contact.vertices) extent = extent.cwiseMax(extents[v]);
  double edge = 0;  // the longest of the shortest ones
  for (const std::int32_t v : pair.contact.vertices)
    if (motion.is_soft(v) && std::isfinite(motion.shortest_edge()[v]))
      edge = std::max(edge, motion.shortest_edge()[v]);
  return std::max(rounding_of(edge), rounding_along(normal, extent));
}

// Whether the edges at the soft vertices of a pair are longer than the bound of its rounding. Where
// they are not, positions do not tell the shape of the body, and parting would tear it.
bool is_resolved(const TouchingPair& pair, double bound, const Motion& motion) {
  return std::all_of(
      pair.contact.vertices.begin(), pair.contact.vertices.end(),
      [&](std::int32_t v) { return !motion.is_soft(v) || motion.shortest_edge()[v] > bound; });
}

// Moves the free vertices of a pair along `normal` by what its gap lacks to `distance`.
void part_pair(const TouchingPair& pair, const Vector3d& normal, double distance,
               const Motion& motion, std::vector<Vector3d>& x, std::vector<char>& is_moved) {
  double gap = 0;
  for (std::size_t i = 0; i < 4; ++i)
    gap += pair.weights[i] * normal.dot(x[pair.contact.vertices[i]]);
  if (gap >= settings::touching::parted_fraction * distance) return;
  const Vector3d move = (distance - gap) * normal;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::int32_t v = pair.contact.vertices[i];
    if (!motion.is_free(v) || pair.weights[i] == 0) continue;
    x[v] += pair.weights[i] > 0 ? move : -move;
    is_moved[v] = 1;
  }
}

// Sets the start to x, rounded, and moves the end with it.
void move_vertex(std::int32_t v, const Vector3d& x, Motion& motion) {
  for (int k = 0; k < 3; ++k) {
    const std::size_t at = 3 * static_cast<std::size_t>(v) + static_cast<std::size_t>(k);
    const btScalar start = static_cast<btScalar>(x[k]);
    motion.end[at] += start - motion.start()[at];
    motion.input().start[at] = start;
  }
}

void sort_once(std::vector<std::int32_t>& vertices) {
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
}

// The vertices that part() has moved, from where they were.
struct Parted {
  const std::vector<btScalar> start, end;  // of all vertices, before
  std::vector<std::int32_t> moved;         // sorted
  Motion& motion;

  // Puts back those that are marked. Returns whether there are any.
  bool put_back(const std::vector<char>& is_marked) {
    const auto stays =
        std::partition(moved.begin(), moved.end(), [&](std::int32_t v) { return !is_marked[v]; });
    const bool any = stays != moved.end();
    for (auto v = stays; v != moved.end(); ++v) {
      const std::size_t at = 3 * static_cast<std::size_t>(*v);
      std::copy_n(&start[at], 3, &motion.input().start[at]);
      std::copy_n(&end[at], 3, &motion.end[at]);
    }
    moved.erase(stays, moved.end());
    return any;
  }
};

// Puts back what passes through something on its way. `reversed`: the pairs that started on the
// wrong side, or as near to it as one rounding, so they may pass through each other; sorted.
bool put_back_crossing(const std::vector<Contact>& reversed, const TouchingQuery& query,
                       Parted& parted) {
  const Motion& motion = parted.motion;
  std::vector<char> crosses(motion.size(), 0);
  for (const Contact& contact :
       query.touching({parted.start.data(), motion.size()}, motion.starts())) {
    if (std::binary_search(reversed.begin(), reversed.end(), contact) || !query.responds(contact))
      continue;
    for (const std::int32_t v : contact.vertices) crosses[v] = 1;
  }
  return parted.put_back(crosses);
}

// Puts back the vertices of edges and faces that pass through each other now and did not `before`:
// the rest of the body is on the other side.
bool put_back_piercing(const std::vector<std::array<std::int32_t, 5>>& before,
                       const TouchingQuery& query, Parted& parted) {
  std::vector<char> pierces(parted.motion.size(), 0);
  for (const std::array<std::int32_t, 5>& pair : query.piercing()) {
    if (std::binary_search(before.begin(), before.end(), pair)) continue;
    for (const std::int32_t v : pair) pierces[v] = 1;
  }
  return parted.put_back(pierces);
}

}  // namespace

bool TouchingStarts::has_moved(std::int32_t vertex) const {
  return std::binary_search(moved_.begin(), moved_.end(), vertex);
}

void TouchingStarts::part(const StepTopology& topology, Span<const Edge> edges,
                          const TouchingQuery& query, Motion& motion) {
  const std::vector<Vector3d> extents = find_extents(topology, motion);
  Parted parted = {motion.start(), motion.end, {}, motion};
  std::vector<Contact> reversed;
  std::vector<std::array<std::int32_t, 5>> pierced;
  std::vector<double> rounding(motion.size());
  std::vector<Vector3d> x(motion.size());
  for (std::size_t v = 0; v < x.size(); ++v) {
    rounding[v] = rounding_of(extents[v].sum());
    x[v] = motion.start_of(static_cast<std::int32_t>(v));
  }
  for (int pass = 0; pass < settings::touching::max_passes; ++pass) {
    const std::vector<TouchingPair> pairs =
        find_touching_pairs(topology.topology(), edges, x, rounding, motion.soft_count(), query);
    if (pairs.empty()) break;
    if (pass == 0) pierced = query.piercing();
    const auto bound = [&](const TouchingPair& pair, const Vector3d& normal) {
      return bound_of(pair, normal, extents, motion);
    };
    const std::vector<Vector3d> normals =
        TouchingSides(topology, edges, motion).normals_of(pairs, bound);
    for (std::size_t i = 0; pass == 0 && i < pairs.size(); ++i)
      if (pairs[i].gap.dot(normals[i]) <= bound(pairs[i], normals[i]) / rounding_count)
        reversed.push_back(pairs[i].contact);
    std::vector<char> is_moved(static_cast<std::size_t>(motion.soft_count()), 0);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double distance = normals[i].isZero() ? 0 : bound(pairs[i], normals[i]);
      if (distance > 0 && is_resolved(pairs[i], distance, motion))
        part_pair(pairs[i], normals[i], distance, motion, x, is_moved);
    }
    bool any_moved = false;
    for (std::int32_t v = 0; v < motion.soft_count(); ++v) {
      if (!is_moved[v]) continue;
      // Many pairs together may ask for more than the shape of the body allows, as each alone may.
      if ((x[v] - Motion::read(parted.start, v)).norm() >= motion.shortest_edge()[v]) {
        x[v] = motion.start_of(v);
        continue;
      }
      any_moved = true;
      move_vertex(v, x[v], motion);
      x[v] = motion.start_of(v);
      parted.moved.push_back(v);
    }
    if (!any_moved) break;
  }
  sort_once(parted.moved);
  std::sort(reversed.begin(), reversed.end());
  while (!parted.moved.empty() && (put_back_crossing(reversed, query, parted) ||
                                   put_back_piercing(pierced, query, parted))) {
  }
  moved_.insert(moved_.end(), parted.moved.begin(), parted.moved.end());
  sort_once(moved_);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
