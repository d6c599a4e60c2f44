#include "step/scene_numbers.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

std::array<btScalar, 3> place_of(const btVector3& x) { return {x.x(), x.y(), x.z()}; }

// Whether no index but -1 is there twice.
bool are_distinct(std::vector<std::int32_t> indices) {
  indices.erase(std::remove(indices.begin(), indices.end(), -1), indices.end());
  std::sort(indices.begin(), indices.end());
  return std::adjacent_find(indices.begin(), indices.end()) == indices.end();
}

}  // namespace

Renumbering SceneNumbers::update(const StepTopology& topology) {
  const std::vector<Numbered> last = std::exchange(bodies_, {});
  const std::vector<int> ids = topology.ids();
  std::map<const btCollisionObject*, std::size_t> index_of;
  for (const StepTopology::BodyRecord& body : topology.bodies()) {
    index_of[body.object] = bodies_.size();
    bodies_.push_back({body.object, ids[bodies_.size()], body.first_vertex, body.vertex_count,
                       body.faces.last - body.faces.first, body.triangles});
  }
  Renumbering numbers;
  numbers.bodies.assign(last.size(), -1);
  for (const Numbered& body : last)
    numbers.vertices.resize(static_cast<std::size_t>(body.first_vertex + body.vertex_count), -1);
  for (std::size_t i = 0; i < last.size(); ++i) {
    const auto found = index_of.find(last[i].object);
    if (found == index_of.end()) continue;
    const Numbered& now = bodies_[found->second];
    if (now.id != last[i].id) continue;
    numbers.bodies[i] = static_cast<std::int32_t>(found->second);
    renumber(last[i], now, numbers);
  }
  LAZYCCD_ASSERT(are_distinct(numbers.bodies), "no two bodies get one new index");
  LAZYCCD_ASSERT(are_distinct(numbers.vertices), "no two vertices get one new index");
  return numbers;
}

void SceneNumbers::renumber(const Numbered& from, const Numbered& to, Renumbering& numbers) {
  const auto set = [&](std::int32_t i, std::int32_t j) {
    numbers.vertices[from.first_vertex + i] = to.first_vertex + j;
  };
  const bool are_same =
      from.triangles == to.triangles ||
      (from.triangles && to.triangles && from.triangles->faces == to.triangles->faces);
  if (are_same) {
    if (from.vertex_count != to.vertex_count || from.face_count != to.face_count) return;
    for (std::int32_t i = 0; i < to.vertex_count; ++i) set(i, i);
    return;
  }
  if (!from.triangles || !to.triangles) return;
  std::map<std::array<btScalar, 3>, std::int32_t> by_place;
  for (std::int32_t i = 0; i < to.vertex_count; ++i)
    by_place.insert({place_of(to.triangles->vertices[i]), i});
  for (std::int32_t i = 0; i < from.vertex_count; ++i) {
    const auto found = by_place.find(place_of(from.triangles->vertices[i]));
    if (found != by_place.end()) set(i, found->second);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
