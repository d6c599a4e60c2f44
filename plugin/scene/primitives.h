// The faces and edges of one soft body that the detector accepts.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Indices are those of the body's nodes.
struct Primitives {
  std::vector<Face> faces;
  std::vector<int> face_indices;  ///< by face: its index in the body
  std::vector<Edge> edges;        ///< no sides of faces
  /// Numbers of faces that are left out: with a node of another body, with a node twice, and with
  /// the nodes of an earlier face.
  int foreign_faces = 0, degenerate_faces = 0, duplicate_faces = 0;
};

/// A link is an edge if one of its ends belongs to no face and no tetrahedron (ropes). Other links
/// lie on the surface or inside the volume, and bending links are not material. If the body has a
/// surface, the nodes inside of its tetrahedra are ends of edges too, one edge for one or two such
/// nodes. Thus they meet other bodies, as Bullet's nodes do, and can't fall through a ground on
/// which the surface rests.
Primitives read_primitives(const btSoftBody& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
