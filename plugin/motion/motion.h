// The motion of all vertices over one step, and what the response makes of it.
#pragma once

#include <LinearMath/btTransform.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

inline Eigen::Vector3d to_eigen(const btVector3& x) {
  return {static_cast<double>(x.x()), static_cast<double>(x.y()), static_cast<double>(x.z())};
}
inline btVector3 to_bullet(const Eigen::Vector3d& x) {
  return btVector3(static_cast<btScalar>(x[0]), static_cast<btScalar>(x[1]),
                   static_cast<btScalar>(x[2]));
}

// What an anchor fixes to a dynamic rigid body, which moves it, and gets what contacts push it
// with.
struct AnchoredVertex {
  btVector3 local;  // in the body's frame
  int rigid;        // index in Motion::rigid
};

// A rigid body over the step, metres and radians. Its frame is that of its centre of mass.
struct RigidMotion {
  std::int32_t first_vertex, vertex_count;
  const btVector3* local;           // its vertices in its own frame
  btTransform start, predicted;     // predicted: where Bullet has it at the end of the step
  btTransform end;                  // after the response
  Eigen::Vector3d velocity, angular_velocity;   // m/s and rad/s, at the end as Bullet has them
  Eigen::Vector3d inverse_mass;     // 1/kg along each axis; zero where nothing moves it
  Eigen::Matrix3d inverse_inertia;  // 1/(kg m^2), in the world's frame at the start
  // What the response adds to the predicted motion: with velocity, and without.
  Eigen::Vector3d translation, rotation, split_translation, split_rotation;
  Eigen::Vector3d velocity_change, angular_velocity_change;  // m/s and rad/s

  // It gives way along or about some axes only.
  bool is_locked() const {
    return (inverse_mass.array() == 0).any() || inverse_inertia.determinant() == 0;
  }
  bool is_dynamic() const { return !inverse_mass.isZero() || !inverse_inertia.isZero(); }
  Eigen::Vector3d centre() const { return to_eigen(start.getOrigin()); }
  // kg; zero where it does not shift, which has no energy and no momentum then.
  double mass() const;
  // kg m^2, in the world's frame; zero about axes that it does not turn about.
  Eigen::Matrix3d inertia() const;
};

struct Motion {
  // Three scalars a vertex, in Bullet's precision, bit for bit what Bullet holds: `end` is what the
  // detector certifies and what Bullet's nodes are then set to.
  std::vector<btScalar> start, end;
  // Of the soft bodies' vertices, which are the first ones:
  std::vector<double> inverse_mass;  // 1/kg; 0 where something else than contact decides the motion
  std::map<std::int32_t, AnchoredVertex> anchored;  // some of these; by vertex
  std::vector<Eigen::Vector3d> velocity;          // m/s, at the end as Bullet has it
  std::vector<double> rate;   // 1/s: velocity per displacement, damping included
  std::vector<double> shortest_edge;  // metres: the shortest edge at the vertex
  // Of the rigid bodies'.
  std::vector<RigidMotion> rigid;
  // By body: its vertices, ended by one past the last; its index in `rigid`, or -1.
  std::vector<std::int32_t> first_vertex, rigid_of_body;
  double dt = 1;  // of the step

  // End of the step as Bullet had it, metres, of all vertices.
  std::vector<Eigen::Vector3d> predicted;
  // Of the response, by soft vertex, metres. `end` is solved + opening, rounded.
  std::vector<Eigen::Vector3d> solved;   // after impulses: velocities follow
  std::vector<Eigen::Vector3d> split_displacement;  // moved further to restore a gap: velocities do not
  std::vector<Eigen::Vector3d> velocity_change;  // m/s: what the nodes' velocities are to receive

  std::size_t size() const { return start.size() / 3; }
  std::int32_t soft_count() const { return static_cast<std::int32_t>(inverse_mass.size()); }
  bool is_soft(std::int32_t vertex) const { return vertex < soft_count(); }

  static Eigen::Vector3d read(const std::vector<btScalar>& positions, std::int32_t i) {
    const btScalar* p = &positions[3 * static_cast<std::size_t>(i)];
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
  Eigen::Vector3d start_of(std::int32_t i) const { return read(start, i); }
  Eigen::Vector3d end_of(std::int32_t i) const { return read(end, i); }

  const RigidMotion& rigid_of(std::int32_t body) const { return rigid[rigid_of_body[body]]; }
  // Impulses move it by itself.
  bool is_free(std::int32_t vertex) const { return is_soft(vertex) && inverse_mass[vertex] > 0; }
  // By itself, or with the dynamic body that carries it.
  bool is_movable(std::int32_t soft_vertex) const {
    return is_free(soft_vertex) || anchor_body_of(soft_vertex) >= 0;
  }
  // Something of infinite mass moves.
  bool has_prescribed_motion() const;
  // How far two vertices that may meet end from where Bullet had them, together, metres: no two
  // by more.
  double largest_deviation_sum(Span<const Body> bodies) const;
  // Index in `rigid` of the body that carries a soft vertex; -1: none.
  int anchor_body_of(std::int32_t soft_vertex) const;

  // Takes the end of the step as it is, Bullet's, for the predicted one.
  void begin_response();
  // Back to the predicted end.
  void restart_response();
  void round_end(std::int32_t soft_vertex);
  // Puts a rigid body and its vertices at the end of the step: where the response has it, and
  // anywhere. What it carries goes with it.
  void place(RigidMotion& body);
  void put(RigidMotion& body, const btTransform& pose);
  // Where the step began, with what it carries, to the last bit.
  void hold(RigidMotion& body);
  void place_start(const RigidMotion& body);

  Positions starts() const { return {start.data(), size()}; }
  Positions ends() const { return {end.data(), size()}; }

 private:
  void set_anchored_end(std::int32_t vertex, const btScalar* x);
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
