// Compares the contacts of two detections bit by bit.
#pragma once

#include <algorithm>

#include "lazyccd/contact.h"
#include "lazyccd/span.h"

namespace lazyccd::test {

/// True if both have the same contacts in the same order, with equal numbers (-0 equals 0).
inline bool same_contacts(Span<const Contact> a, Span<const Contact> b) {
  const auto equal = [](const Contact& x, const Contact& y) {
    return !(x < y) && !(y < x) && x.toi == y.toi && x.u == y.u && x.v == y.v &&
           x.normal == y.normal;
  };
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), equal);
}

}  // namespace lazyccd::test
