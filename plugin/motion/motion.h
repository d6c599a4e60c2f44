// The motion of all vertices over one step, as Bullet predicts it and as the contact response
// changes it.
#pragma once

#include <LinearMath/btTransform.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"
#include "motion/anchored_vertices.h"
#include "motion/supports.h"
#include "settings.h"
#include "util/matrix.h"
#include "util/scratch_vector.h"

class btCollisionObject;

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

inline Vector3d to_double(const btVector3& x) {
  return {static_cast<double>(x.x()), static_cast<double>(x.y()), static_cast<double>(x.z())};
}
inline btVector3 to_bullet(const Vector3d& x) {
  return btVector3(static_cast<btScalar>(x[0]), static_cast<btScalar>(x[1]),
                   static_cast<btScalar>(x[2]));
}

/// What the response makes of a rigid body, in metres and radians. Rotations are rotation vectors.
struct RigidSolution {
  btTransform end;  ///< pose at the end of the step; Bullet's until the response begins
  /// Motion that the response adds to the predicted pose. The first two come from impulses, and
  /// velocities follow them; the split ones come from split impulses and do not change velocities.
  Vector3d translation, rotation, split_translation, split_rotation;
  Vector3d velocity_change, angular_velocity_change;  ///< m/s, rad/s
  /// Where other rigid bodies support it. The response takes those away that it leaves.
  ScratchVector<Support> supports;
  /// How it moves while it is held at its supports, in place of inverse mass and inertia.
  std::optional<Mobility> supported_mobility;
  /// What impulses on it add to its velocity besides the changes above: the supports resist that,
  /// so it stays in place until Bullet's next solve. m/s, rad/s.
  Vector3d load_velocity = Vector3d::Zero(), load_angular_velocity = Vector3d::Zero();
};

/// Motion of a rigid body over the step: what Bullet wants of it, and the solution. The origin of
/// its frame is the centre of mass.
struct RigidMotion : RigidSolution {
  const btCollisionObject* object = nullptr;
  std::int32_t first_vertex, vertex_count;
  const btVector3* local;  ///< its vertices in its own frame
  /// The same at the start of the step, if children of a compound have moved since; or null.
  const btVector3* local_at_start = nullptr;
  btTransform start, predicted;         ///< predicted: Bullet's pose for the end of the step
  Vector3d velocity, angular_velocity;  ///< Bullet's, at the end of the step; m/s, rad/s
  Vector3d inverse_mass;     ///< 1/kg along each world axis; 0: no motion along that axis
  Matrix3d inverse_inertia;  ///< 1/(kg m^2), in the world frame, at the start of the step
  /// A static body that has a velocity and stays where it is, as a conveyor belt: friction sees its
  /// surface move with the velocity.
  bool is_conveyor = false;
  /// A body that impulses move, and that the application moved before the step: its velocity does
  /// not tell how fast it moves.
  bool is_driven = false;
  bool is_ball = false;                  ///< its surface is a ball about its centre of mass
  ScratchVector<std::int32_t> anchored;  ///< soft vertices that are anchored to it
  /// Link of a multibody: index in Motion::articulated. Otherwise -1. A link has no inverse mass of
  /// its own: its multibody has, and gives it `translation` and the like.
  int articulated = -1;

  /// Whether none of its vertices moves.
  bool stands_still() const { return start == end && !local_at_start; }
  /// Whether some axis of translation or rotation is locked.
  bool is_locked() const {
    return inverse_mass.x() == 0 || inverse_mass.y() == 0 || inverse_mass.z() == 0 ||
           inverse_inertia.determinant() == 0;
  }
  /// Whether it is a rigid body of finite mass; false for links.
  bool is_dynamic() const {
    return inverse_mass.cwiseAbs().maxCoeff() > settings::displacement::min_inverse_mass ||
           inverse_inertia.cwiseAbs().maxCoeff() > settings::displacement::min_inverse_mass;
  }
  /// Whether impulses move it.
  bool is_movable() const { return is_dynamic() || articulated >= 0; }
  Vector3d centre() const { return to_double(start.getOrigin()); }
  /// Bullet's velocity of the body at a point, m/s.
  Vector3d velocity_at(const Vector3d& point) const {
    return velocity + angular_velocity.cross(point - centre());
  }
  /// Mass, kg; 0 if the body cannot translate, as it then has no linear momentum or energy.
  double mass() const;
  /// Inertia tensor, kg m^2, in the world frame; zero about locked axes.
  Matrix3d inertia() const;
};

struct ArticulatedMotion;  // articulated_motion.h

/// What a step reads, before the response. The soft vertices come first; arrays "by soft vertex"
/// have an element for these only.
struct StepInput {
  /// Positions at the start of the step, three scalars per vertex, bit for bit as Bullet holds
  /// them, but for what TouchingStarts moved out of rounding.
  std::vector<btScalar> start;
  /// By soft vertex, 1/kg; 0: contacts do not decide the motion (pinned or anchored).
  std::vector<double> inverse_mass;
  AnchoredVertices anchored;       ///< set by anchor()
  std::vector<Vector3d> velocity;  ///< by soft vertex: Bullet's, at the end of the step, m/s
  std::vector<double> rate;        ///< by soft vertex: velocity per displacement, with damping, 1/s
  std::vector<double> shortest_edge;  ///< by soft vertex: its shortest edge, metres
  std::vector<double> median_edge;    ///< by soft body: the median of these, metres
  std::vector<RigidMotion> rigid;
  std::vector<std::int32_t> first_vertex,  ///< by body; one more element ends the last body
      rigid_of_body;                       ///< by body: index in `rigid`, or -1
  double dt = 1;                           ///< length of the step, seconds

  /// Anchors a soft vertex to a body of `rigid`, and releases it from any other.
  void anchor(std::int32_t soft_vertex, const AnchoredVertex& fixed);
  void release(std::int32_t soft_vertex);
  /// Sets the start positions of the vertices of a rigid body from its start pose.
  void write_start_vertices(const RigidMotion& body);
};

/// Positions, masses and velocities of all vertices over one step: what the step reads, which the
/// response cannot change, and what the response makes of it.
class Motion {
 public:
  Motion();
  Motion(const Motion&);
  Motion(Motion&&) noexcept;
  Motion& operator=(const Motion&);
  Motion& operator=(Motion&&) noexcept;
  ~Motion();

  /// For those who read the step: StepReader, the solvers' Fill, and what moves the start.
  StepInput& input() { return input_; }
  // Its members, as all others see them.
  const std::vector<btScalar>& start() const { return input_.start; }
  const std::vector<double>& inverse_mass() const { return input_.inverse_mass; }
  const AnchoredVertices& anchored() const { return input_.anchored; }
  const std::vector<Vector3d>& velocity() const { return input_.velocity; }
  const std::vector<double>& rate() const { return input_.rate; }
  const std::vector<double>& shortest_edge() const { return input_.shortest_edge; }
  const std::vector<double>& median_edge() const { return input_.median_edge; }
  const std::vector<RigidMotion>& rigid() const { return input_.rigid; }
  const std::vector<std::int32_t>& first_vertex() const { return input_.first_vertex; }
  const std::vector<std::int32_t>& rigid_of_body() const { return input_.rigid_of_body; }
  double dt() const { return input_.dt; }

  // What the response changes, with the solutions of rigid bodies.
  /// Positions at the end of the step, three scalars per vertex. Bullet's prediction at first. The
  /// detector certifies them, and Bullet's nodes are set to them.
  std::vector<btScalar> end;
  std::vector<ArticulatedMotion> articulated;  ///< multibodies whose links are in rigid()
  /// All vertices at the end of the step before the response, metres: Bullet's prediction plus
  /// untangling. Valid after begin_response().
  std::vector<Vector3d> predicted;
  /// By vertex, metres: what find_turn_displacement() found. Empty: nothing was found yet.
  std::vector<Vector3d> turn_displacement;
  /// By soft vertex: displacement that the body's own links add to the prediction, once contacts
  /// have moved it, metres.
  std::vector<Vector3d> link_displacement;
  /// By body: whether its link_displacement is not zero. Empty: none is.
  std::vector<char> links_moved;
  // Results of the response, by soft vertex. `end` is solved + split_displacement, rounded.
  std::vector<Vector3d> solved;  ///< positions after impulses, metres; velocities follow
  /// Displacement that restores gaps, metres; velocities do not follow it.
  std::vector<Vector3d> split_displacement;
  std::vector<Vector3d> velocity_change;  ///< to be added to the nodes' velocities, m/s

  std::size_t size() const { return start().size() / 3; }
  std::int32_t soft_count() const { return static_cast<std::int32_t>(inverse_mass().size()); }
  bool is_soft(std::int32_t vertex) const { return vertex < soft_count(); }

  static Vector3d read(const std::vector<btScalar>& positions, std::int32_t i) {
    const btScalar* p = &positions[3 * static_cast<std::size_t>(i)];
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
  Vector3d start_of(std::int32_t i) const { return read(start(), i); }
  Vector3d end_of(std::int32_t i) const { return read(end, i); }

  const RigidMotion& rigid_of(std::int32_t body) const { return rigid()[rigid_of_body()[body]]; }
  /// The solution of a body of rigid().
  RigidSolution& solution_of(const RigidMotion& body) { return input_.rigid[index_of(body)]; }
  /// 1/kg; 0 for vertices of rigid bodies too.
  double inverse_mass_of(std::int32_t vertex) const {
    return is_soft(vertex) ? inverse_mass()[vertex] : 0;
  }
  /// Whether impulses move the vertex itself: a soft vertex of finite mass.
  bool is_free(std::int32_t vertex) const { return is_soft(vertex) && inverse_mass()[vertex] > 0; }
  /// Whether impulses move the vertex itself or the dynamic body that it is anchored to.
  bool is_movable(std::int32_t soft_vertex) const {
    return is_free(soft_vertex) || anchor_body_of(soft_vertex) >= 0;
  }
  /// Whether anything of infinite mass moves in a body in this step: a pinned node, or all of a
  /// static or kinematic body.
  bool has_prescribed_motion(std::int32_t body) const;
  /// True if the deviations of any two vertices that may collide, each from Bullet's predicted end,
  /// certainly add up to less than a limit: `between_bodies`, or within body b `within_body[b]`,
  /// metres. `bodies`: all bodies of the scene.
  bool deviates_less_than(Span<const Body> bodies, double between_bodies,
                          Span<const double> within_body) const;
  /// Index in rigid() of the body that a soft vertex is anchored to; -1 if there is none.
  int anchor_body_of(std::int32_t soft_vertex) const;

  /// Makes the present end of the step the predicted one, and resets the response.
  void begin_response();
  /// Resets the response: everything ends at the predicted positions.
  void restart_response();
  /// The same for one body; for a link of a multibody, for all of its links.
  void restart_response(std::int32_t body);
  /// Contacts take the motion of a rigid body as linear in its rotation. A body that turns far ends
  /// elsewhere. Sets turn_displacement to the difference at the present end, so that the next solve
  /// starts from where the body really is (Newton's method).
  void find_turn_displacement();
  /// End of a vertex that no impulse moves itself, without the impulses on its body, metres.
  Vector3d end_without_impulses(std::int32_t vertex) const {
    if (turn_displacement.empty()) return predicted[vertex];
    return predicted[vertex] + turn_displacement[vertex];
  }
  /// Sets the end of a soft vertex to solved + split_displacement, rounded to btScalar.
  void round_end(std::int32_t soft_vertex) {
    const Vector3d x = solved[soft_vertex] + split_displacement[soft_vertex];
    for (int k = 0; k < 3; ++k)
      end[3 * static_cast<std::size_t>(soft_vertex) + k] = static_cast<btScalar>(x[k]);
  }
  // Here a body is one of rigid().
  /// Adds the motion of the response to the predicted pose of a rigid body. Sets the end of the
  /// body, its vertices and its anchored vertices.
  void apply_response(const RigidMotion& body);
  /// Sets the ends of all links of a multibody that the response moves, and Bullet's body with
  /// them.
  void apply_response(ArticulatedMotion& body);
  /// Sets the end of a link, and of its whole multibody, to the start.
  void hold_at_start(ArticulatedMotion& body);
  /// Sets the end of a rigid body to `pose`, with its vertices and its anchored vertices.
  void set_end_pose(const RigidMotion& body, const btTransform& pose);
  /// Sets the end of a rigid body, its vertices and its anchored vertices to their start, exactly
  /// to the bit.
  void set_end_to_start(const RigidMotion& body);
  /// Whether children of a compound moved in the step, and the response has put them back.
  bool is_held(const RigidMotion& body) const;
  /// Sets the end of a soft vertex to its start, exactly to the bit. Its velocity stays that of the
  /// solved motion.
  void set_end_to_start(std::int32_t soft_vertex);

  Positions starts() const { return {start().data(), size()}; }
  Positions ends() const { return {end.data(), size()}; }

 private:
  std::size_t index_of(const RigidMotion& body) const {
    return static_cast<std::size_t>(&body - rigid().data());
  }
  void restart_response(const RigidMotion& body);
  void read_link_poses(const ArticulatedMotion& body);
  void set_anchored_end(std::int32_t vertex, const btScalar* x);

  StepInput input_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
