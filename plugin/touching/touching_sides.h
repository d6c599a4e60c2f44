// Decides on which side of each other two bodies are that touch at the start of a step.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "motion/motion.h"
#include "scene/step_topology.h"
#include "touching/oriented_surface.h"
#include "touching/touching_pairs.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The sides at the start of one step. Surfaces are read when a pair asks for them. The arguments
/// must outlive it.
class TouchingSides {
 public:
  TouchingSides(const StepTopology& topology, Span<const Edge> edges, const Motion& motion)
      : topology_(topology), edges_(edges), motion_(motion) {}

  /// Bound of the rounding of a pair's gap along a unit vector, metres.
  using Bound = std::function<double(const TouchingPair&, const Vector3d& normal)>;
  /// By pair: unit vector from b to a along which the pair must be apart; zero if there is none.
  std::vector<Vector3d> normals_of(const std::vector<TouchingPair>& pairs, const Bound& bound);

 private:
  using Normal = OrientedSurface::Normal;

  /// What tells the side of a patch of pairs that no solid decides. Positive: the body with the
  /// smaller index is where the references of its pairs point to.
  struct Votes {
    double gap = 0, bound = 0, neighbours = 0;  // metres
    double velocity = 0;                        // m/s
    bool first_is_ahead() const;
  };

  const OrientedSurface& surface_of(std::int32_t body);
  /// The surface of one side of a pair at its closest point.
  Normal surface_at(const TouchingPair& pair, bool is_a);
  /// The normal of a pair that a solid decides; zero if none does.
  static Vector3d normal_of_solid(const Normal& of_a, const Normal& of_b);
  /// Unit vector across the surfaces, with the same side for all pairs of a patch. `bound`: of the
  /// rounding of positions, metres.
  Vector3d reference_of(const TouchingPair& pair, const Normal& of_a, const Normal& of_b,
                        double bound) const;
  void add_votes(const TouchingPair& pair, const Vector3d& reference, double bound, Votes& votes);
  /// Mean height of what surrounds one side of a pair above its closest point, metres.
  double height_of_neighbours(const TouchingPair& pair, bool is_a, const Vector3d& up);
  const std::vector<std::int32_t>& neighbours_of(std::int32_t vertex);
  const Vector3d& mean_velocity(std::int32_t body);

  const StepTopology& topology_;
  Span<const Edge> edges_;
  const Motion& motion_;
  std::map<std::int32_t, OrientedSurface> surfaces_;              // by body
  std::map<std::int32_t, std::vector<std::int32_t>> neighbours_;  // by vertex
  std::map<std::int32_t, Vector3d> mean_velocities_;              // by body, m/s
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
