// Thickness and friction of a pair of bodies: the one place where both are decided.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "lazyccd/bullet/options.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// What one body brings to its contacts.
struct BodySurface {
  double margin;    ///< collision margin, metres
  double friction;  ///< soft body: m_cfg.kDF; rigid body: getFriction()
  bool is_soft;
};

/// What two bodies make of it.
struct PairSurface {
  double thickness;  ///< gap that a contact keeps, metres
  double friction;   ///< Coulomb's coefficient
};

class PairSurfaces {
 public:
  /// Bullet's rule for the friction between two soft bodies: the larger of the two coefficients in
  /// the rigid world, their product in the deformable world.
  using SoftFriction = double (*)(double kdf_a, double kdf_b);

  PairSurfaces(const SolverOptions& options, SoftFriction soft_friction)
      : thickness_(options.thickness), has_friction_(options.friction),
        soft_friction_(soft_friction) {}

  /// Sets the bodies of this step, by body index. `resolution`: least thickness, metres.
  void update(std::vector<BodySurface> bodies, double resolution) {
    bodies_ = std::move(bodies);
    resolution_ = resolution;
  }

  PairSurface of(std::int32_t body_a, std::int32_t body_b) const {
    const BodySurface &a = bodies_[body_a], &b = bodies_[body_b];
    const double wanted = thickness_ >= 0 ? thickness_ : a.margin + b.margin;
    // Between a soft and a rigid body Bullet multiplies the coefficients in both worlds.
    const double friction = a.is_soft && b.is_soft ? soft_friction_(a.friction, b.friction)
                                                   : a.friction * b.friction;
    return {std::max(resolution_, wanted), has_friction_ ? friction : 0};
  }

 private:
  double thickness_;  // metres; negative: the sum of the margins
  bool has_friction_;
  SoftFriction soft_friction_;
  std::vector<BodySurface> bodies_;
  double resolution_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
