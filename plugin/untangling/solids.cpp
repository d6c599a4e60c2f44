#include "untangling/solids.h"

#include <algorithm>

#include "untangling/closed_surfaces.h"
#include "untangling/face_geometry.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// True if no two of the faces run along a side in the same direction.
bool are_oriented_alike(const Topology& topology, const std::vector<std::int32_t>& faces) {
  std::vector<Edge> sides;
  for (const std::int32_t f : faces) {
    const Face& face = topology.faces[f];
    for (int k = 0; k < 3; ++k) sides.push_back({face[k], face[(k + 1) % 3]});
  }
  std::sort(sides.begin(), sides.end());
  return std::adjacent_find(sides.begin(), sides.end()) == sides.end();
}

Box3d box_of(const FaceGeometry& geometry, const std::vector<std::int32_t>& faces) {
  Box3d box;
  for (const std::int32_t f : faces)
    for (int k = 0; k < 3; ++k) box.extend(geometry.corner(f, k));
  return box;
}

}  // namespace

PartsOfObstacle::PartsOfObstacle(const StepTopology& topology, std::int32_t obstacle)
    : first_vertex_(topology.bodies()[obstacle].first_vertex),
      keys_(static_cast<std::size_t>(topology.bodies()[obstacle].vertex_count)) {
  const Topology view = topology.topology();
  const IndexRange range = topology.bodies()[obstacle].faces;
  DisjointSets sets(keys_.size());
  for (std::int32_t f = range.first; f < range.last; ++f) {
    const Face& face = view.faces[f];
    sets.join(face[0] - first_vertex_, face[1] - first_vertex_);
    sets.join(face[0] - first_vertex_, face[2] - first_vertex_);
  }
  for (std::size_t v = 0; v < keys_.size(); ++v) keys_[v] = sets.find(static_cast<std::int32_t>(v));
  for (std::int32_t f = range.first; f < range.last; ++f)
    faces_[key_of(view.faces[f][0])].push_back(f);
}

std::vector<Solid> find_solids(const PartsOfObstacle& parts, const Topology& topology,
                               const Motion& motion) {
  const FaceGeometry geometry(topology, motion);
  std::vector<Solid> closed;
  std::vector<char> points_outwards;
  for (const auto& [key, faces] : parts.faces()) {
    if (!is_closed_mesh(topology, faces)) continue;
    closed.push_back(
        {faces, box_of(geometry, faces), key, true, are_oriented_alike(topology, faces)});
    points_outwards.push_back(volume_of(topology, motion, faces) > 0);
  }
  const auto count = static_cast<std::int32_t>(closed.size());
  DisjointSets sets(closed.size());
  std::vector<std::int32_t> cavities;
  for (std::int32_t i = 0; i < count; ++i)
    if (!points_outwards[i]) cavities.push_back(i);
  for (std::int32_t i = 0; i < count; ++i) {
    for (const std::int32_t cavity : cavities)
      if (points_outwards[i] && closed[i].box.contains(closed[cavity].box)) sets.join(i, cavity);
  }
  std::map<std::int32_t, Solid> solids;  // by the first of their parts
  for (std::int32_t i = 0; i < count; ++i) {
    const auto [entry, is_new] = solids.try_emplace(sets.find(i), closed[i]);
    if (is_new) continue;
    Solid& solid = entry->second;
    solid.faces.insert(solid.faces.end(), closed[i].faces.begin(), closed[i].faces.end());
    solid.box.extend(closed[i].box);
    solid.is_single = false;
    solid.is_oriented = solid.is_oriented && closed[i].is_oriented;
  }
  std::vector<Solid> result;
  for (auto& [first, solid] : solids) {
    if (solid.is_single && !points_outwards[first]) continue;
    std::sort(solid.faces.begin(), solid.faces.end());
    result.push_back(std::move(solid));
  }
  return result;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
