// RandomSource: random choices that are the same on every platform. The standard library's
// distributions are not.
#pragma once

#include <LinearMath/btQuaternion.h>
#include <LinearMath/btVector3.h>

#include <cmath>
#include <cstdint>
#include <random>

namespace lazyccd::test {

inline btScalar scalar(double x) { return static_cast<btScalar>(x); }

/// A Mersenne Twister with the random choices that test scenes need.
class RandomSource {
 public:
  explicit RandomSource(std::uint32_t number) : engine_(number) {}

  double uniform() { return engine_() / 4294967296.0; }  ///< in [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Log-uniform: all orders of magnitude between low and high are equally likely.
  double across_scales(double low, double high) { return low * std::pow(high / low, uniform()); }
  /// In [0, count).
  int below(int count) { return static_cast<int>(engine_() % static_cast<std::uint32_t>(count)); }
  bool chance(double probability) { return uniform() < probability; }

  /// A point of the cube [-half, half]^3.
  btVector3 in_cube(double half) {
    const double x = uniform(-half, half), y = uniform(-half, half), z = uniform(-half, half);
    return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z));
  }
  /// A unit vector, uniform on the sphere.
  btVector3 direction() {
    for (;;) {
      const btVector3 d = in_cube(1);
      if (d.length2() > btScalar(0.01) && d.length2() < 1) return d.normalized();
    }
  }
  btQuaternion rotation() {
    return btQuaternion(direction(), static_cast<btScalar>(uniform(0, 6.28)));
  }

 private:
  std::mt19937 engine_;
};

}  // namespace lazyccd::test
