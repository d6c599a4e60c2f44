#include "motion/supports.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "motion/motion.h"
#include "settings.h"
#include "util/decompositions.h"
#include "util/matrix.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Part of the mobility without supports that may be rounding error.
constexpr double rounding = 1e-6;

// A matrix whose square is the mobility without supports.
Mobility root_of_free_mobility(const RigidMotion& body) {
  Mobility root = Mobility::Zero();
  root.set_block(0, 0, diagonal_matrix(body.inverse_mass.cwiseMax(0).cwiseSqrt()));
  const SymmetricEigen<3> inertia(body.inverse_inertia);
  const Vector3d roots = inertia.values.cwiseMax(0).cwiseSqrt();
  root.set_block(3, 3, inertia.vectors * diagonal_matrix(roots) * inertia.vectors.transpose());
  return root;
}

Matrix3d across(const Vector3d& normal) {
  return Matrix3d::Identity() - normal * normal.transpose();
}

// The directions in which a support holds the body, as a projection.
Matrix3d held_directions(const Support& support) {
  return support.slides ? support.normal * support.normal.transpose() : Matrix3d::Identity();
}

// What holds a body, in coordinates in which its mobility is the identity.
struct Hold {
  Mobility root;  // its square is the mobility without supports
  // Of the sum over the supports; each counts the same, wherever it is.
  SymmetricEigen<6> directions;

  explicit Hold(const RigidMotion& body)
      : root(root_of_free_mobility(body)), directions(sum_over(body.supports)) {}

  Mobility sum_over(Span<const Support> supports) const {
    Mobility sum = Mobility::Zero();
    for (const Support& support : supports) {
      const Matrix<3, 6> held = held_by(support);
      sum += held.transpose() * held;
    }
    return sum;
  }
  // Its product with a motion is the displacement of the support in the directions that it holds.
  Matrix<3, 6> held_by(const Support& support) const {
    const Matrix<3, 6> point = support.jacobian() * root;
    const double size = point.norm();
    if (!(size > 0)) return Matrix<3, 6>::Zero();
    return held_directions(support) * point / size;
  }
  bool holds(int direction) const {
    return directions.values[direction] >
           settings::supports::min_held_part * settings::supports::min_held_part;
  }
};

// Finds what supports exert against an impulse, within their bounds, by projected Gauss-Seidel.
class Reaction {
 public:
  Reaction(const RigidMotion& body, const Vector6d& impulse) {
    const Mobility mobility = free_mobility(body);
    moved_ = mobility * impulse;
    double largest = 0;  // displacement without supports
    for (const Support& support : body.supports) {
      Point& point = points_.emplace_back();
      point.support = &support;
      point.effect = mobility * support.jacobian().transpose();
      const Matrix3d compliance = support.jacobian() * point.effect;
      point.normal_compliance = support.normal.dot(compliance * support.normal);
      point.tangent_compliance = compliance.trace() - point.normal_compliance;
      largest = std::max(largest, displacement(point).norm());
    }
    tolerance_ = settings::supports::holding_fraction * largest;
    start(body, impulse);
    for (int i = 0; i < settings::supports::max_sweeps &&
                    sweep() > settings::supports::settled_fraction * tolerance_;
         ++i) {
    }
  }

  // Displacement of a support, metres.
  Vector3d displacement(std::size_t i) const { return displacement(points_[i]); }
  // A support that moves no farther is held.
  double tolerance() const { return tolerance_; }

 private:
  struct Point {
    const Support* support;
    Matrix<6, 3> effect;  // of an impulse on it on the motion of the body
    double normal_compliance, tangent_compliance;
    Vector3d impulse = Vector3d::Zero();
  };

  Vector3d displacement(const Point& point) const {
    return moved_.head<3>() + moved_.tail<3>().cross(point.support->arm);
  }

  // Starts from the smallest impulses that hold everything. Mostly they are within their bounds.
  void start(const RigidMotion& body, const Vector6d& impulse) {
    const Hold hold(body);
    const Vector6d pushed = hold.root * impulse;
    Vector6d resisted = Vector6d::Zero();
    for (int k = 0; k < 6; ++k) {
      const Vector6d direction = hold.directions.vectors.col(k);
      if (hold.holds(k)) resisted += direction.dot(pushed) / hold.directions.values[k] * direction;
    }
    for (Point& point : points_) {
      const double size = (point.support->jacobian() * hold.root).norm();
      if (size > 0) set(point, -(hold.held_by(*point.support) * resisted) / size);
    }
  }

  // Returns the largest change of a displacement.
  double sweep() {
    double largest = 0;
    for (Point& point : points_) {
      if (!(point.normal_compliance > 0)) continue;
      const Vector3d& normal = point.support->normal;
      const Vector3d before = displacement(point);
      const double along = normal.dot(before);
      Vector3d push = point.impulse - along / point.normal_compliance * normal;
      if (point.tangent_compliance > 0)
        push -= (before - along * normal) / point.tangent_compliance;
      set(point, push);
      largest = std::max(largest, (displacement(point) - before).norm());
    }
    return largest;
  }

  // Sets the impulse of a support, within its bounds.
  void set(Point& point, const Vector3d& impulse) {
    const Support& support = *point.support;
    const double normal = std::max(-support.load, support.normal.dot(impulse));
    Vector3d bounded = normal * support.normal;
    if (!support.slides) {
      Vector3d total =
          support.friction_impulse + impulse - support.normal.dot(impulse) * support.normal;
      const double limit = support.friction * (support.load + normal);
      if (total.squaredNorm() > limit * limit) total *= limit / total.norm();
      bounded += total - support.friction_impulse;
    }
    moved_ += point.effect * (bounded - point.impulse);
    point.impulse = bounded;
  }

  std::vector<Point> points_;
  Vector6d moved_;  // translation and rotation of the body
  double tolerance_;
};

}  // namespace

Matrix<3, 6> Support::jacobian() const {
  Matrix<3, 6> j;
  j.set_block(0, 0, Matrix3d::Identity());
  j.set_block(0, 3, -cross_matrix(arm));
  return j;
}

Mobility free_mobility(const RigidMotion& body) {
  Mobility mobility = Mobility::Zero();
  mobility.set_block(0, 0, diagonal_matrix(body.inverse_mass));
  mobility.set_block(3, 3, body.inverse_inertia);
  return mobility;
}

std::optional<Mobility> mobility_at_supports(const RigidMotion& body) {
  if (body.supports.empty()) return std::nullopt;
  const Hold hold(body);
  Mobility mobility = Mobility::Zero();
  for (int k = 0; k < 6; ++k) {
    if (hold.holds(k)) continue;
    const Vector6d moved = hold.root * hold.directions.vectors.col(k);
    mobility += moved * moved.transpose();
  }
  // What is left by rounding would decay to denormal numbers in the contact solver, which are slow.
  const Vector6d sizes = free_mobility(body).diagonal().cwiseMax(0).cwiseSqrt();
  for (int k = 0; k < 6; ++k) {
    for (int i = 0; i < 6; ++i)
      if (std::abs(mobility(i, k)) < rounding * (sizes[i] * sizes[k])) mobility(i, k) = 0;
  }
  return mobility;
}

bool leave_supports(const RigidMotion& body, const Vector6d& impulse, RigidSolution& solution) {
  if (!body.supported_mobility) return false;
  const Reaction reaction(body, impulse);
  ScratchVector<Support> kept;
  bool any = false;
  for (std::size_t i = 0; i < body.supports.size(); ++i) {
    Support support = body.supports[i];
    const Vector3d displacement = reaction.displacement(i);
    const bool leaves = support.normal.dot(displacement) > reaction.tolerance(),
               slides = !support.slides &&
                        (across(support.normal) * displacement).norm() > reaction.tolerance();
    support.slides = support.slides || slides;
    any = any || leaves || slides;
    if (!leaves) kept.push_back(support);
  }
  if (!any) return false;
  solution.supports = std::move(kept);
  solution.supported_mobility = mobility_at_supports(body);
  return true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
