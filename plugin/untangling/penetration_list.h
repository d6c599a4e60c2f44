// Collects penetrations as contacts.
#pragma once

#include <cstdint>

#include "lazyccd/contact.h"
#include "untangling/face_geometry.h"
#include "untangling/penetrations.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Adds the penetrations of one obstacle. The arguments of the constructor must outlive it.
class PenetrationList {
 public:
  PenetrationList(const Topology& topology, const Motion& motion, std::int32_t obstacle,
                  Penetrations& found)
      : topology_(topology), motion_(motion), obstacle_(obstacle), found_(found) {}

  /// A soft vertex inside of the obstacle; see InsideVertex.
  void add_inside(std::int32_t v, double depth) { found_.inside.push_back({v, obstacle_, depth}); }
  /// What stays where it is.
  void add_trapped(std::int32_t v) { found_.trapped.vertices.push_back({v, obstacle_}); }
  void add_trapped(const Edge& edge);
  void add_trapped(Face face);
  /// A soft vertex that leaves through a side.
  void add(std::int32_t v, const Side& side);
  /// The point at `at` along a soft edge. Of the face only one side is used: its plane counts.
  void add(const Edge& edge, double at, const Side& side);
  /// The point of a soft face at barycentric coordinates u and v of its second and third corner.
  /// Here the obstacle's side is the vertex.
  void add(std::int32_t face, double u, double v, const Side& side);
  /// A soft edge that passes through the surface; sorted vertices.
  void add_passing(const Edge& edge) { found_.edges.push_back({edge[0], edge[1], obstacle_}); }
  /// A soft face that passes through the surface.
  void add_passing(Face face);

 private:
  Contact contact_with(const Side& side, std::int32_t soft_vertex, ContactKind kind) const;

  const Topology& topology_;
  const Motion& motion_;
  std::int32_t obstacle_;
  Penetrations& found_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
