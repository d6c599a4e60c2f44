// Vectors with three components of any number type: float, double, or several lanes.
#pragma once

#include "core/platform.h"

namespace lazyccd {

template <class T>
struct Vec3 {
  T x, y, z;
};

template <class T>
LAZYCCD_HD inline Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class T>
LAZYCCD_HD inline Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class T>
LAZYCCD_HD inline Vec3<T> operator*(const T& s, const Vec3<T>& a) {
  return {s * a.x, s * a.y, s * a.z};
}

template <class T>
LAZYCCD_HD inline T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
LAZYCCD_HD inline Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// The cross product with every term taken positive. It bounds each component of cross(a, b) for
/// all vectors whose components do not exceed those of a and b.
template <class T>
LAZYCCD_HD inline Vec3<T> cross_bound(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x};
}

}  // namespace lazyccd
