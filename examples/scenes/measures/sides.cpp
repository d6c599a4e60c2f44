#include "scenes/measures/sides.h"

#include <optional>

namespace lazyccd::scenes {
namespace {

// Returns the height of a face at the x and z of a point; nothing if the face does not reach there.
std::optional<double> height_at(const btSoftBody::Face& face, const btVector3& p) {
  const btVector3 &a = face.m_n[0]->m_x, &b = face.m_n[1]->m_x, &c = face.m_n[2]->m_x;
  const auto area = [](const btVector3& u, const btVector3& v, const btVector3& w) {
    return static_cast<double>(v.x() - u.x()) * static_cast<double>(w.z() - u.z()) -
           static_cast<double>(v.z() - u.z()) * static_cast<double>(w.x() - u.x());
  };
  const double whole = area(a, b, c);
  if (whole == 0) return std::nullopt;
  const double wa = area(p, b, c) / whole, wb = area(a, p, c) / whole, wc = 1 - wa - wb;
  if (wa < 0 || wb < 0 || wc < 0) return std::nullopt;
  return wa * static_cast<double>(a.y()) + wb * static_cast<double>(b.y()) +
         wc * static_cast<double>(c.y());
}

}  // namespace

bool is_below(const btVector3& point, const btSoftBody& cloth) {
  bool below = false, above = false;
  for (int f = 0; f < cloth.m_faces.size(); ++f) {
    const std::optional<double> height = height_at(cloth.m_faces[f], point);
    if (height) (static_cast<double>(point.y()) < *height ? below : above) = true;
  }
  return below && !above;
}

int nodes_below(const btSoftBody& body, int first, int last, const btSoftBody& cloth) {
  int count = 0;
  for (int i = first; i <= last; ++i) count += is_below(body.m_nodes[i].m_x, cloth);
  return count;
}

}  // namespace lazyccd::scenes
