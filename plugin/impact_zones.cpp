#include "impact_zones.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Turning further than this in one step is cut short, radians: the linear path of a node would
// leave the circle too far.
constexpr double largest_turn = 1;

// Rotation vector of the step from angular momentum and inertia; none about an axis without
// inertia.
Vector3d turn(const Matrix3d& inertia, const Vector3d& momentum) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(inertia);
  const double smallest = 1e-9 * axes.eigenvalues()[2];
  Vector3d result = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (axes.eigenvalues()[k] <= smallest) continue;
    const Vector3d axis = axes.eigenvectors().col(k);
    result += axis.dot(momentum) / axes.eigenvalues()[k] * axis;
  }
  const double angle = result.norm();
  if (angle > largest_turn) result *= largest_turn / angle;
  return result;
}

}  // namespace

ImpactZones::ImpactZones(const Motion& motion) : parent_(motion.size()), solved_(motion.solved) {
  std::iota(parent_.begin(), parent_.end(), 0);
}

std::int32_t ImpactZones::find(std::int32_t i) {
  while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
  return i;
}

std::int64_t ImpactZones::node_count() const {
  // A node is alone where it is its own root and nobody else's parent.
  std::vector<char> in_zone(parent_.size(), 0);
  for (std::size_t i = 0; i < parent_.size(); ++i) {
    if (parent_[i] != static_cast<std::int32_t>(i)) in_zone[i] = in_zone[parent_[i]] = 1;
  }
  return std::count(in_zone.begin(), in_zone.end(), 1);
}

void ImpactZones::absorb(const std::vector<Contact>& contacts, Motion& motion) {
  for (const Contact& contact : contacts) {
    for (int i = 1; i < 4; ++i) {
      const std::int32_t a = find(contact.vertices[0]), b = find(contact.vertices[i]);
      parent_[std::max(a, b)] = std::min(a, b);
    }
  }
  std::map<std::int32_t, std::vector<std::int32_t>> zones;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(parent_.size()); ++i) {
    const std::int32_t root = find(i);
    if (root != i) {
      std::vector<std::int32_t>& zone = zones[root];
      if (zone.empty()) zone.push_back(root);
      zone.push_back(i);
    }
  }
  for (const auto& zone : zones) move(zone.second, motion);
}

void ImpactZones::move(const std::vector<std::int32_t>& zone, Motion& motion) const {
  double mass = 0;
  Vector3d centre = Vector3d::Zero(), shift = Vector3d::Zero();
  bool pinned = false, alike = true;
  Vector3d pinned_shift = Vector3d::Zero();
  for (const std::int32_t v : zone) {
    const Vector3d moved = solved_[v] - motion.start_of(v);
    if (motion.inverse_mass[v] > 0) {
      const double m = 1 / motion.inverse_mass[v];
      mass += m;
      centre += m * motion.start_of(v);
      shift += m * moved;
    } else if (!pinned) {
      pinned = true;
      pinned_shift = moved;
    } else {
      alike = alike && moved == pinned_shift;
    }
  }

  Matrix3d rotation = Matrix3d::Identity();
  if (pinned) {
    shift = alike ? pinned_shift : Vector3d::Zero();
  } else {
    centre /= mass;
    shift /= mass;
    Matrix3d inertia = Matrix3d::Zero();
    Vector3d momentum = Vector3d::Zero();
    for (const std::int32_t v : zone) {
      const double m = 1 / motion.inverse_mass[v];
      const Vector3d arm = motion.start_of(v) - centre;
      inertia += m * (arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose());
      momentum += m * arm.cross(solved_[v] - motion.start_of(v));
    }
    const Vector3d angles = turn(inertia, momentum);
    const double angle = angles.norm();
    if (angle > 0) rotation = Eigen::AngleAxisd(angle, angles / angle).toRotationMatrix();
  }
  for (const std::int32_t v : zone) {
    if (motion.inverse_mass[v] == 0) continue;
    const Vector3d start = motion.start_of(v);
    motion.solved[v] = start + shift;
    if (!pinned) motion.solved[v] += rotation * (start - centre) - (start - centre);
    motion.opening[v].setZero();
    motion.round_end(v);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
