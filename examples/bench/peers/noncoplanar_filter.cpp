// The non-coplanar filter by itself (Tang, Manocha, Tong 2010); see peer.h.
#include "bench/peers/peer.h"
#include "bench/peers/vec3.h"

namespace lazyccd::peers {

template <class Real>
QueryResult noncoplanar_filter(ContactKind kind, const QueryPoints& points) {
  const Frame<Real> f = frame(kind, rounded<Real>(points));
  const Vec3<Real> n0 = cross(f.a[0], f.b[0]), n2 = cross(f.a[1], f.b[1]);
  const Vec3<Real> n1 = Real(0.5) * (n0 + n2 - cross(f.a[1] - f.a[0], f.b[1] - f.b[0]));
  const Real k[4] = {dot(n0, f.c[0]), (dot(n0, f.c[1]) + 2 * dot(n1, f.c[0])) / 3,
                     (dot(n2, f.c[0]) + 2 * dot(n1, f.c[1])) / 3, dot(n2, f.c[1])};
  const bool above = k[0] > 0 && k[1] > 0 && k[2] > 0 && k[3] > 0;
  const bool below = k[0] < 0 && k[1] < 0 && k[2] < 0 && k[3] < 0;
  return {!above && !below, 0};
}

template QueryResult noncoplanar_filter<float>(ContactKind, const QueryPoints&);
template QueryResult noncoplanar_filter<double>(ContactKind, const QueryPoints&);

}  // namespace lazyccd::peers
