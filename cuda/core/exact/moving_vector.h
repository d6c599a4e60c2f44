// Vectors that are linear in time, and their products.
#pragma once

#include "core/exact/polynomial.h"

namespace lazyccd::exact {

/// The vector (1-t) start + t end.
template <class Integer>
struct MovingVector {
  Integer start[3], end[3];
};

/// Component k of the cross product, of degree 2.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED Poly<Integer> cross(const MovingVector<Integer>& a,
                                              const MovingVector<Integer>& b, int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const Integer ai = a.start[i], aj = a.start[j], bi = b.start[i], bj = b.start[j], ai1 = a.end[i],
                aj1 = a.end[j], bi1 = b.end[i], bj1 = b.end[j];
  return Poly<Integer>::quadratic(Integer::dot({ai, aj}, {bj, bi}, 0b10),
                                  Integer::dot({ai, ai1, aj, aj1}, {bj1, bj, bi1, bi}, 0b1100),
                                  Integer::dot({ai1, aj1}, {bj1, bi1}, 0b10));
}

/// The scalar product, of degree 2.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED Poly<Integer> dot(const MovingVector<Integer>& a,
                                            const MovingVector<Integer>& b) {
  const Integer *a0 = a.start, *a1 = a.end, *b0 = b.start, *b1 = b.end;
  return Poly<Integer>::quadratic(Integer::dot({a0[0], a0[1], a0[2]}, {b0[0], b0[1], b0[2]}),
                                  Integer::dot({a0[0], a0[1], a0[2], a1[0], a1[1], a1[2]},
                                               {b1[0], b1[1], b1[2], b0[0], b0[1], b0[2]}),
                                  Integer::dot({a1[0], a1[1], a1[2]}, {b1[0], b1[1], b1[2]}));
}

/// The scalar product with a vector whose components have degree 2: of degree 3.
template <class Integer>
LAZYCCD_HD LAZYCCD_CALLED Poly<Integer> dot(const Poly<Integer> (&a)[3],
                                            const MovingVector<Integer>& b) {
  const Integer *x = a[0].c, *y = a[1].c, *z = a[2].c, *b0 = b.start, *b1 = b.end;
  const auto inner = [&](int i) {
    return Integer::dot({x[i], y[i], z[i], x[i - 1], y[i - 1], z[i - 1]},
                        {b0[0], b0[1], b0[2], b1[0], b1[1], b1[2]});
  };
  return {3,
          {Integer::dot({x[0], y[0], z[0]}, {b0[0], b0[1], b0[2]}), inner(1), inner(2),
           Integer::dot({x[2], y[2], z[2]}, {b1[0], b1[1], b1[2]})}};
}

}  // namespace lazyccd::exact
