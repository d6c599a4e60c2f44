// A multibody of boxes: a base and links with joints, motors and colliders.
#pragma once

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <memory>
#include <vector>

namespace lazyccd::scenes::behaviour {

enum class Joint { fixed, revolute, prismatic };

/// A box of a multibody.
struct BoxLink {
  int parent = -1;  // index of the link that it hangs on; -1: the base
  Joint joint = Joint::fixed;
  btVector3 axis = btVector3(0, 1, 0);    // of the joint; unit length
  btVector3 pivot = btVector3(0, 0, 0);   // from the parent's centre to the joint, metres
  btVector3 centre = btVector3(0, 0, 0);  // from the joint to this link's centre, metres
  btVector3 size = btVector3(1, 1, 1);    // whole sides, metres
  double mass = 1;                        // kg
};

/// Owns the multibody, its shapes, colliders and motors. A size of zero: no collider.
class Multibody {
 public:
  Multibody(const btVector3& place, const btVector3& base_size, double base_mass, bool fixed_base,
            const std::vector<BoxLink>& links);
  ~Multibody();

  btMultiBody& body() { return *body_; }
  const btMultiBody& body() const { return *body_; }
  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& colliders() const {
    return colliders_;
  }
  /// Adds a motor with a limit of force, N.
  btMultiBodyJointMotor* add_motor(int link, double force, double step_seconds);
  void add_to(btMultiBodyDynamicsWorld& world);

  /// Kinetic energy of all links, J.
  double kinetic_energy() const;
  double potential_energy(double gravity) const;  // J; 0 at y = 0
  /// Returns the largest speed of a centre of a link or the base, m/s.
  double fastest_link() const;

 private:
  void add_collider(int link, const btVector3& size);

  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  std::vector<std::unique_ptr<btMultiBodyJointMotor>> motors_;
  btMultiBodyDynamicsWorld* world_ = nullptr;
};

}  // namespace lazyccd::scenes::behaviour
