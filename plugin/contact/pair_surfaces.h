// Thickness and friction of a pair of bodies. Both are decided only here.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "lazyccd/bullet/options.h"
#include "lazyccd/debug/assert.h"
#include "lazyccd/scene.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The two kinds of Bullet's worlds with soft bodies.
enum class WorldKind {
  rigid,      ///< btSoftRigidDynamicsWorld, btSoftMultiBodyDynamicsWorld
  deformable  ///< btDeformableMultiBodyDynamicsWorld
};

/// Contact properties of one body.
struct BodySurface {
  double margin;    ///< collision margin, metres
  double friction;  ///< soft body: m_cfg.kDF; rigid body: getFriction()
  bool is_soft;
  double hardness = 0;  ///< soft body: m_cfg.kSHR, Bullet's hardness of soft contacts, 0 to 1
  int iterations = 0;   ///< soft body: m_cfg.piterations
  /// Soft body: smallest thickness that its coordinates resolve, metres (StepReader::resolution()).
  double resolution = 0;
};

/// Friction of Bullet's rigid world: each of its position iterations takes a fraction of the
/// sliding speed of a contact, whatever the load is (btSoftBody::PSolve_RContacts,
/// PSolve_SContacts).
struct SlidingFriction {
  /// By side: fraction that one iteration takes if the contact points of this side alone move.
  std::array<double, 2> per_iteration = {0, 0};
  int iterations = 0;
  bool between_soft_bodies = false;

  /// Fraction of the sliding speed that all iterations of a step take, from 0 to 1. Between soft
  /// bodies Bullet moves vertex i of side s by share_s w_i per_iteration_s times the sliding:
  /// `shares`: by side, its share of the sum of inverse masses at the contact points; `squares`: by
  /// side, the sum of its squared weights.
  double per_step(const std::array<double, 2>& shares, const std::array<double, 2>& squares) const {
    const double one = between_soft_bodies ? per_iteration[0] * shares[0] * squares[0] +
                                                 per_iteration[1] * shares[1] * squares[1]
                                           : per_iteration[0];
    const double kept = 1 - std::clamp(one, 0.0, 1.0);
    double kept_by_all = 1;
    for (int i = 0; i < iterations && kept_by_all > 1e-9; ++i) kept_by_all *= kept;
    return 1 - kept_by_all;
  }
};

/// Contact properties of a pair of bodies.
struct PairSurface {
  double thickness = 0;      ///< gap that a contact keeps, metres
  double resolution = 0;     ///< smallest gap that a contact can keep, metres
  double parting_speed = 0;  ///< m/s; positive while the two are being moved apart
  double friction = 0;       ///< Coulomb's coefficient
  SlidingFriction sliding;   ///< does nothing with Coulomb's friction
};

/// Combines the surfaces of two bodies as SolverOptions and Bullet's world prescribe.
class PairSurfaces {
 public:
  PairSurfaces(const SolverOptions& options, WorldKind world)
      : thickness_(options.thickness),
        has_friction_(options.friction),
        is_coulomb_(options.coulomb_friction || world == WorldKind::deformable),
        world_(world),
        untangling_speed_(options.untangling_speed) {}

  /// Sets the bodies of this step, by body index.
  void update(Span<const BodySurface> bodies) {
    LAZYCCD_ASSERT(std::all_of(bodies.begin(), bodies.end(),
                               [](const BodySurface& body) {
                                 return body.margin >= 0 && std::isfinite(body.margin);
                               }),
                   "margins are finite and not negative");
    bodies_.assign(bodies.begin(), bodies.end());
    least_margin_ = least_soft_margin_ = std::numeric_limits<double>::infinity();
    for (const BodySurface& body : bodies_) {
      least_margin_ = std::min(least_margin_, body.margin);
      if (body.is_soft) least_soft_margin_ = std::min(least_soft_margin_, body.margin);
    }
  }

  /// Sets the upper bounds of the thickness of each body's pairs, metres: what contacts are looked
  /// for within. A gap that a contact is to keep but that is not seen would be corrected and lost
  /// in turn. The bounds stay until the next call.
  void limit_thickness(Span<const double> limits) {
    limits_.assign(limits.begin(), limits.end());
    least_limit_ = std::numeric_limits<double>::infinity();
    for (const double limit : limits_) least_limit_ = std::min(least_limit_, limit);
  }

  /// Sets the pairs of bodies that are being moved apart in this step. They have no friction.
  /// Smaller index first, sorted.
  void set_moved_apart(Span<const BodyPair> pairs) {
    LAZYCCD_ASSERT(std::is_sorted(pairs.begin(), pairs.end()), "pairs to be parted are sorted");
    moved_apart_.assign(pairs.begin(), pairs.end());
  }

  /// Lower bound of the thickness of any pair of this body, metres; needs update() first.
  double least_thickness_of(std::int32_t body) const {
    const BodySurface& own = bodies_[body];
    return bounded(own.margin + (own.is_soft ? least_margin_ : least_soft_margin_), least_limit_,
                   own.resolution);
  }

  /// Surface of the pair; needs update() first. Friction is 0 if SolverOptions::friction is off.
  PairSurface of(std::int32_t body_a, std::int32_t body_b) const {
    LAZYCCD_ASSERT(is_body(body_a) && is_body(body_b), "a pair is of bodies of the step");
    const BodySurface &a = bodies_[body_a], &b = bodies_[body_b];
    PairSurface surface;
    surface.resolution = std::max(a.resolution, b.resolution);
    surface.thickness = bounded(a.margin + b.margin, std::min(limit_of(body_a), limit_of(body_b)),
                                surface.resolution);
    // Between a soft and a rigid body Bullet multiplies in both worlds. Between two soft bodies it
    // takes the larger one (CollideVF_SS) or the product (CollideVF_DD).
    const bool soft_soft = a.is_soft && b.is_soft;
    const double friction = soft_soft && world_ == WorldKind::rigid
                                ? std::max(a.friction, b.friction)
                                : a.friction * b.friction;
    if (is_moved_apart(body_a, body_b)) {
      surface.parting_speed = settings::untangling::gap_speed * untangling_speed_;
      return surface;
    }
    if (!has_friction_) return surface;
    surface.friction = friction;
    if (is_coulomb_) return surface;
    surface.sliding.iterations = std::max(a.iterations, b.iterations);
    surface.sliding.between_soft_bodies = soft_soft;
    surface.sliding.per_iteration = {friction * (soft_soft ? a.hardness : 1),
                                     friction * (soft_soft ? b.hardness : 1)};
    return surface;
  }

 private:
  bool is_body(std::int32_t i) const {
    return i >= 0 && i < static_cast<std::int32_t>(bodies_.size());
  }
  double limit_of(std::int32_t body) const {
    if (limits_.empty()) return std::numeric_limits<double>::infinity();
    LAZYCCD_ASSERT(limits_.size() == bodies_.size(), "each body of the step has its limit");
    return limits_[body];
  }
  double bounded(double sum_of_margins, double limit, double resolution) const {
    const double wanted = thickness_ >= 0 ? thickness_ : sum_of_margins;
    return std::max(resolution, std::min(wanted, limit));
  }
  bool is_moved_apart(std::int32_t a, std::int32_t b) const {
    return std::binary_search(moved_apart_.begin(), moved_apart_.end(),
                              BodyPair{std::min(a, b), std::max(a, b)});
  }

  double thickness_;  // metres; negative: the sum of the margins
  bool has_friction_, is_coulomb_;
  WorldKind world_;
  double untangling_speed_;  // m/s
  std::vector<BodySurface> bodies_;
  std::vector<BodyPair> moved_apart_;
  double least_margin_ = 0, least_soft_margin_ = 0;  // of all bodies, of soft ones; metres
  std::vector<double> limits_;                       // by body, or empty: none; metres
  double least_limit_ = std::numeric_limits<double>::infinity();
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
