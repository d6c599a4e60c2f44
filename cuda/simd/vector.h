// Vectors of numbers with the operators of C++, element by element: the vector types of GCC and
// Clang, or plain arrays with LAZYCCD_PLAIN_CPP. Both give the same bits. No other file uses the
// compilers' extensions for vectors.
//
// A comparison gives a vector of integers of the same size: -1 where it holds, 0 elsewhere.
#pragma once

#include <math.h>

#include <cstdint>
#include <cstring>
#include <type_traits>

#include "simd/inline.h"

#ifndef LAZYCCD_ISA
#error "compile with -DLAZYCCD_ISA=<name>"
#endif

namespace lazyccd {
namespace LAZYCCD_ISA {

#if !defined(LAZYCCD_PLAIN_CPP)

template <class T, int n>
struct SimdVectorType {
  typedef T type __attribute__((vector_size(n * sizeof(T))));
  typedef T unaligned __attribute__((vector_size(n * sizeof(T)), aligned(alignof(T))));
};

/// n numbers of type T, aligned to their size. {} is zero; v[i] is element i.
template <class T, int n>
using SimdVector = typename SimdVectorType<T, n>::type;

/// Reads n numbers of type T from an address that is aligned for one.
template <class T, int n>
LAZYCCD_INLINE SimdVector<T, n> load_unaligned(const T* p) {
  return *reinterpret_cast<const typename SimdVectorType<T, n>::unaligned*>(p);
}

/// Returns the elements of a where the mask is -1, of b where it is 0.
template <class Mask, class V>
LAZYCCD_INLINE V choose(const Mask& mask, const V& a, const V& b) {
  return mask ? a : b;
}

/// Returns the same bits as a vector of another type.
template <class To, class From>
LAZYCCD_INLINE To bit_cast(const From& x) {
  return reinterpret_cast<To>(x);
}

/// Converts each element.
template <class To, class From>
LAZYCCD_INLINE To convert(const From& x) {
  return __builtin_convertvector(x, To);
}

/// Returns chosen elements: number i is element i of a, or i - n of b.
#if defined(__clang__) || __GNUC__ >= 12
template <int... chosen, class V>
LAZYCCD_INLINE auto shuffle(const V& a, const V& b) {
  return __builtin_shufflevector(a, b, chosen...);
}
#else  // GCC 11 lacks it
template <int... chosen, class V>
LAZYCCD_INLINE auto shuffle(const V& a, const V& b) {
  using T = std::decay_t<decltype(a[0])>;
  constexpr int n = sizeof(V) / sizeof(T);
  return SimdVector<T, sizeof...(chosen)>{(chosen < n ? a[chosen % n] : b[chosen % n])...};
}
#endif

#else  // LAZYCCD_PLAIN_CPP

template <int size>
struct SimdInteger;
template <>
struct SimdInteger<4> {
  using type = std::int32_t;
};
template <>
struct SimdInteger<8> {
  using type = std::int64_t;
};

template <class T, int n>
struct alignas(n * sizeof(T)) SimdVector {
  using Element = T;
  using Mask = SimdVector<typename SimdInteger<sizeof(T)>::type, n>;
  static constexpr int count = n;

  T element[n];

  LAZYCCD_INLINE T& operator[](int i) { return element[i]; }
  LAZYCCD_INLINE const T& operator[](int i) const { return element[i]; }

  static LAZYCCD_INLINE SimdVector repeat(T x) {
    SimdVector v;
    for (int i = 0; i < n; ++i) v.element[i] = x;
    return v;
  }

#define LAZYCCD_BINARY(op)                                                                   \
  friend LAZYCCD_INLINE SimdVector operator op(const SimdVector& a, const SimdVector& b) {   \
    SimdVector v;                                                                            \
    for (int i = 0; i < n; ++i) v.element[i] = static_cast<T>(a.element[i] op b.element[i]); \
    return v;                                                                                \
  }                                                                                          \
  friend LAZYCCD_INLINE SimdVector operator op(const SimdVector& a, T b) {                   \
    return a op repeat(b);                                                                   \
  }                                                                                          \
  friend LAZYCCD_INLINE SimdVector operator op(T a, const SimdVector& b) {                   \
    return repeat(a) op b;                                                                   \
  }                                                                                          \
  LAZYCCD_INLINE SimdVector& operator op##=(const SimdVector& b) { return *this = *this op b; }
#define LAZYCCD_COMPARISON(op)                                                                \
  friend LAZYCCD_INLINE Mask operator op(const SimdVector& a, const SimdVector& b) {          \
    Mask m;                                                                                   \
    for (int i = 0; i < n; ++i) m.element[i] = a.element[i] op b.element[i] ? -1 : 0;         \
    return m;                                                                                 \
  }                                                                                           \
  friend LAZYCCD_INLINE Mask operator op(const SimdVector& a, T b) { return a op repeat(b); } \
  friend LAZYCCD_INLINE Mask operator op(T a, const SimdVector& b) { return repeat(a) op b; }

  LAZYCCD_BINARY(+)
  LAZYCCD_BINARY(-)
  LAZYCCD_BINARY(*)
  LAZYCCD_BINARY(/)
  // Bits, of integers only.
  LAZYCCD_BINARY(&)
  LAZYCCD_BINARY(|)
  LAZYCCD_BINARY(<<)
  LAZYCCD_BINARY(>>)
  LAZYCCD_COMPARISON(<)
  LAZYCCD_COMPARISON(<=)
  LAZYCCD_COMPARISON(>)
  LAZYCCD_COMPARISON(>=)
  LAZYCCD_COMPARISON(==)
  LAZYCCD_COMPARISON(!=)
#undef LAZYCCD_BINARY
#undef LAZYCCD_COMPARISON

  friend LAZYCCD_INLINE SimdVector operator-(const SimdVector& a) {
    SimdVector v;
    for (int i = 0; i < n; ++i) v.element[i] = -a.element[i];
    return v;
  }
  friend LAZYCCD_INLINE SimdVector operator~(const SimdVector& a) {
    SimdVector v;
    for (int i = 0; i < n; ++i) v.element[i] = ~a.element[i];
    return v;
  }
};

template <class T, int n>
LAZYCCD_INLINE SimdVector<T, n> load_unaligned(const T* p) {
  SimdVector<T, n> v;
  std::memcpy(v.element, p, sizeof v.element);
  return v;
}

template <class Mask, class V>
LAZYCCD_INLINE V choose(const Mask& mask, const V& a, const V& b) {
  V v;
  for (int i = 0; i < V::count; ++i) v.element[i] = mask.element[i] ? a.element[i] : b.element[i];
  return v;
}

template <class To, class From>
LAZYCCD_INLINE To bit_cast(const From& x) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &x, sizeof to);
  return to;
}

template <class To, class From>
LAZYCCD_INLINE To convert(const From& x) {
  To to;
  for (int i = 0; i < To::count; ++i)
    to.element[i] = static_cast<typename To::Element>(x.element[i]);
  return to;
}

template <int... chosen, class V>
LAZYCCD_INLINE auto shuffle(const V& a, const V& b) {
  return SimdVector<typename V::Element, sizeof...(chosen)>{
      {(chosen < V::count ? a.element[chosen % V::count] : b.element[chosen % V::count])...}};
}

#endif

/// The correctly rounded square root of each element.
template <class V>
LAZYCCD_INLINE V square_root(V x) {
  constexpr bool single = sizeof(x[0]) == sizeof(float);
  for (int i = 0; i < static_cast<int>(sizeof(V) / sizeof(x[0])); ++i)
    if constexpr (single) {
      x[i] = ::sqrtf(x[i]);
    } else {
      x[i] = ::sqrt(x[i]);
    }
  return x;
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
