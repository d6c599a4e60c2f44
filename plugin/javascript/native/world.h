// A Bullet world with its bodies, as the JavaScript package offers it. It knows nothing of
// JavaScript, so it is also compiled and tested natively.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <lazyccd/bullet/options.h>
#include <lazyccd/bullet/report.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace lazyccd::javascript {

enum class Kind { rigid, deformable };      ///< which of Bullet's worlds
enum class Collisions { lazyccd, bullet };  ///< who handles those of soft bodies

/// A soft body before it is added; the arrays are read once. Lengths in metres, masses in kg.
struct SoftBodyDescription {
  std::vector<float> positions;     ///< x, y, z of each node
  std::vector<std::int32_t> faces;  ///< three nodes each
  std::vector<std::int32_t> links;  ///< two nodes each; empty: the edges of faces and tetrahedra
  std::vector<std::int32_t> tetrahedra;  ///< four nodes each
  std::vector<std::int32_t> pinned;      ///< nodes that do not move
};

/// Numbers of a soft body that can be set at any time. Names and meanings are Bullet's, unless a
/// comment says otherwise.
enum class SoftBodyNumber {
  mass,           ///< of the whole body, spread evenly over the nodes that are not pinned
  margin,         ///< m
  stiffness,      ///< m_kLST of the rigid world, 0 to 1
  friction,       ///< kDF
  damping,        ///< kDP
  pressure,       ///< kPR
  iterations,     ///< piterations
  self_collision  ///< 0 or 1
};

/// What acts on the contacts of the last step, as arrays with an entry for each contact.
struct ContactArrays {
  std::vector<std::int32_t> bodies;  ///< two numbers of bodies each
  std::vector<std::int32_t>
      nodes;  ///< four each: a vertex and a face, or two edges; -1: of no soft body
  std::vector<std::int32_t> kinds;     ///< ContactKind
  std::vector<float> points, normals;  ///< x, y, z each
  std::vector<float> impulses, times;  ///< N s; 0 to 1 of the step

  void clear();  ///< keeps the memory
};

/// A world. Bodies have numbers from 0 on, which are never used again.
class World {
 public:
  World(Kind kind, Collisions collisions, const btVector3& gravity,
        const bullet::SolverOptions& options);
  ~World();

  int add(const SoftBodyDescription& description);
  /// Springs along the links of a body of the deformable world, N/m and N s/m.
  void add_springs(int body, double stiffness, double damping);
  /// Linear elasticity of the tetrahedra of a body of the deformable world: Lamé's numbers, Pa, and
  /// damping.
  void add_elasticity(int body, double mu, double lambda, double damping);
  /// Links between nodes that are `distance` links apart (btSoftBody::generateBendingConstraints).
  void add_bending(int body, int distance);
  void set(int body, SoftBodyNumber number, double value);
  void pin(int body, int node, bool is_pinned);
  /// Moves a pinned node to `goal` at the end of the next step.
  void steer(int body, int node, const btVector3& goal);
  void push(int body, int node, const btVector3& force);  ///< N, for one step; node -1: all
  /// Puts all nodes elsewhere, with these velocities if there are any. Nothing is swept.
  void place(int body, const float* positions, const float* velocities);

  /// Adds a rigid body: static with mass 0, kinematic if is_kinematic. Owns the shape, and `parts`
  /// that the shape refers to.
  int add(std::unique_ptr<btCollisionShape> shape, std::shared_ptr<void> parts, double mass,
          bool is_kinematic, const btTransform& pose, double friction);
  /// Moves a kinematic body to a pose at the end of the next step. Soft bodies feel the motion.
  void move(int body, const btTransform& pose);
  /// Puts a rigid body elsewhere. Nothing is swept.
  void teleport(int body, const btTransform& pose);

  void remove(int body);
  void step(double seconds);

  bool has(int body) const;
  int node_count(int body) const;
  /// Packed x, y, z of each node; valid until the next call for this body.
  const std::vector<float>& positions(int body);
  const std::vector<float>& velocities(int body);
  /// Position and rotation (x, y, z, w) of a rigid body; valid until the next call for it.
  const std::vector<float>& pose(int body);
  const ContactArrays& contacts();         ///< of the last step; empty with Bullet alone
  const bullet::StepStats* stats() const;  ///< null with Bullet alone
  std::string status() const;

 private:
  struct Solver;
  struct Body;
  Body& soft(int body);
  void steer_nodes(double seconds);

  Kind kind_;
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  std::unique_ptr<Solver> solver_;
  std::vector<std::unique_ptr<Body>> bodies_;  // by number; null: removed
  ContactArrays contacts_;
};

}  // namespace lazyccd::javascript
