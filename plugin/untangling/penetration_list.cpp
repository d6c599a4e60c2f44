#include "untangling/penetration_list.h"

#include <algorithm>
#include <utility>

#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void PenetrationList::add_trapped(const Edge& edge) {
  found_.trapped.edges.push_back({edge[0], edge[1], obstacle_});
}

void PenetrationList::add_trapped(Face face) {
  std::sort(face.begin(), face.end());
  found_.trapped.faces.push_back({face[0], face[1], face[2], obstacle_});
}

void PenetrationList::add_passing(Face face) {
  std::sort(face.begin(), face.end());
  found_.faces.push_back({face[0], face[1], face[2], obstacle_});
}

Contact PenetrationList::contact_with(const Side& side, std::int32_t soft_vertex,
                                      ContactKind kind) const {
  Contact contact = {};
  contact.kind = kind;
  contact.body_a = topology_.body_of_vertex[soft_vertex];
  contact.body_b = obstacle_;
  contact.primitive_b = side.face;
  for (int k = 0; k < 3; ++k) contact.normal[k] = static_cast<float>(side.normal[k]);
  return contact;
}

void PenetrationList::add(std::int32_t v, const Side& side) {
  const Face& f = topology_.faces[side.face];
  Contact contact = contact_with(side, v, ContactKind::vertex_face);
  contact.primitive_a = v;
  contact.vertices = {v, f[0], f[1], f[2]};
  // Barycentric coordinates of the vertex, projected onto the face's plane.
  const Vector3d a = motion_.start_of(f[0]), ab = motion_.start_of(f[1]) - a,
                 ac = motion_.start_of(f[2]) - a, area = ab.cross(ac);
  const Vector3d point = motion_.start_of(v) - a;
  contact.u = static_cast<float>(point.cross(ac).dot(area) / area.squaredNorm());
  contact.v = static_cast<float>(ab.cross(point).dot(area) / area.squaredNorm());
  found_.contacts.push_back(contact);
  found_.vertices.push_back({v, obstacle_});
}

void PenetrationList::add(const Edge& edge, double at, const Side& side) {
  const Face& f = topology_.faces[side.face];
  Contact contact = contact_with(side, edge[0], ContactKind::edge_edge);
  contact.primitive_a = edge[0];
  contact.vertices = {edge[0], edge[1], f[0], f[1]};
  const Vector3d a = motion_.start_of(edge[0]),
                 along = motion_.start_of(f[1]) - motion_.start_of(f[0]);
  const Vector3d point = a + at * (motion_.start_of(edge[1]) - a) - motion_.start_of(f[0]);
  contact.u = static_cast<float>(at);
  contact.v = static_cast<float>(point.dot(along) / along.squaredNorm());
  found_.contacts.push_back(contact);
}

void PenetrationList::add(std::int32_t face, double u, double v, const Side& side) {
  const Face& f = topology_.faces[face];
  Contact contact = contact_with(side, f[0], ContactKind::vertex_face);
  std::swap(contact.body_a, contact.body_b);
  contact.primitive_a = topology_.faces[side.face][0];
  contact.primitive_b = face;
  contact.vertices = {topology_.faces[side.face][0], f[0], f[1], f[2]};
  for (float& x : contact.normal) x = -x;
  contact.u = static_cast<float>(u);
  contact.v = static_cast<float>(v);
  found_.contacts.push_back(contact);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
