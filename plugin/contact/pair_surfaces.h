// Thickness and friction of a pair of bodies. Both are decided only here.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "lazyccd/bullet/options.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Contact properties of one body.
struct BodySurface {
  double margin;    ///< collision margin, metres
  double friction;  ///< soft body: m_cfg.kDF; rigid body: getFriction()
  bool is_soft;
};

/// Contact properties of a pair of bodies.
struct PairSurface {
  double thickness;  ///< gap that a contact keeps, metres
  double friction;   ///< Coulomb's coefficient
};

/// How Bullet combines the coefficients of two soft bodies.
enum class FrictionRule {
  larger,  ///< the larger of the two: rigid world (btSoftBody::CollideVF_SS)
  product  ///< the product: deformable world (btSoftBody::CollideVF_DD)
};

/// Combines the surfaces of two bodies as SolverOptions and Bullet's world prescribe.
class PairSurfaces {
 public:
  PairSurfaces(const SolverOptions& options, FrictionRule soft_friction)
      : thickness_(options.thickness),
        has_friction_(options.friction),
        soft_friction_(soft_friction) {}

  /// Sets the bodies of this step, by body index. `resolution`: lower bound of every thickness,
  /// metres.
  void update(std::vector<BodySurface> bodies, double resolution) {
    bodies_ = std::move(bodies);
    resolution_ = resolution;
  }

  /// Surface of the pair; needs update() first. Friction is 0 if SolverOptions::friction is off.
  PairSurface of(std::int32_t body_a, std::int32_t body_b) const {
    const BodySurface &a = bodies_[body_a], &b = bodies_[body_b];
    const double wanted = thickness_ >= 0 ? thickness_ : a.margin + b.margin;
    // Between a soft and a rigid body Bullet multiplies in both worlds.
    const bool multiplies = !a.is_soft || !b.is_soft || soft_friction_ == FrictionRule::product;
    const double friction = multiplies ? a.friction * b.friction : std::max(a.friction, b.friction);
    return {std::max(resolution_, wanted), has_friction_ ? friction : 0};
  }

 private:
  double thickness_;  // metres; negative: the sum of the margins
  bool has_friction_;
  FrictionRule soft_friction_;
  std::vector<BodySurface> bodies_;
  double resolution_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
