// Contacts of the last step, as the momentum equation of this step expects them to act again.
//
// Contacts are found after Bullet's implicit damping is solved. Damping that does not know of them
// carries the velocity of a whole body on to the nodes that a contact holds. Each step then stops
// the momentum of these few nodes only, and the body is too soft where it is touched. With damping
// proportional to stiffness by the time b, the force F dents the body by b dt F / m too much. m is
// the mass of a node.
//
// An expected contact is an augmented Lagrangian: the force of the last step, and a penalty on
// velocities that differ from those after the last step. Both act while damping is solved. Then
// the impulses are taken back from the nodes in contact, because the contact solver finds and
// applies the true ones. What is left is a damping force between nodes. It keeps momentum, and it
// is zero where nothing damps. If the contact acts as expected, the motion is as if damping and
// contacts had been solved together.
//
// An impulse of the last step may have been balanced by one that acts no longer: that of a moving
// body that squeezed cloth against the contact. Such impulses have any size, and alone they throw
// the cloth off. A contact does not push what leaves it. So a contact whose points would leave
// each other is not expected to act.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "bodies/conjugate_residual.h"
#include "bodies/contact_penalties.h"
#include "bodies/equation_islands.h"
#include "lazyccd/bullet/precision.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/span.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ExpectedContacts {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;
  using Multiply = std::function<void(const VectorStack& x, VectorStack& b)>;

  /// `jump_speed`: as in SolverOptions, m/s.
  explicit ExpectedContacts(btScalar jump_speed = 5) : jump_speed_(jump_speed) {}

  /// Keeps the contacts of a step that has ended, with the velocities and positions of its end.
  /// `without`: bodies whose contacts change from step to step, sorted. `dt`: its length, seconds.
  void take(Span<const StepContact> contacts, const std::vector<const btSoftBody*>& without,
            btScalar dt);
  void forget() { taken_.clear(); }

  /// Starts a step. Then tell it the pairs that Bullet hands on in this step; on any thread.
  void begin_step() { met_.clear(); }
  void meet(const btSoftBody& body, const btCollisionObject& rigid);

  /// Selects what may act in this step: between nodes of `bodies` that are where the last step left
  /// them, awake and without an anchor. A rigid body that they touch must be handed on in this
  /// step. The application may have moved it on, but not faster than a jump. `inverse_mass`: by
  /// node, 1/kg. Returns false if nothing may act.
  bool select(const Bodies& bodies, const std::vector<btScalar>& inverse_mass, btScalar dt);
  /// Finds how much damping adds to the inertia of the nodes in contact; drops contacts where that
  /// is little. `multiply` is the matrix of the momentum equation, `size` its size. Returns false
  /// if nothing is left.
  bool find_penalties(const Multiply& multiply, int size);

  /// Pairs of bodies in contact, as indices in the list, some more than once; twice the same body
  /// if only one is soft and can move.
  ScratchVector<std::array<int, 2>> body_pairs() const;
  /// Divides the contacts by the islands, for functions that take the number of one. They may be
  /// called for several islands at the same time.
  void divide(Span<const EquationIsland> islands);

  /// Sets the velocity changes `dv` of bodies in contact to a first guess: as if they moved on as
  /// they did after the last step.
  void guess(const Bodies& bodies, const VectorStack& velocity, VectorStack& dv) const;
  /// Adds the impulses at the velocities of before to the right hand side.
  void add_right_hand_side(std::size_t island, const VectorStack& velocity,
                           VectorStack& right_hand_side) const;
  /// Number of contacts that were not dropped.
  std::size_t count(std::size_t island) const { return of_island(island).size(); }
  /// Adds the penalties times x to b, on the calling thread alone.
  void multiply(std::size_t island, const VectorStack& x, VectorStack& b) const;
  /// Copies what multiply() uses, for several threads.
  void copy_penalties(std::size_t island, ContactPenalties& penalties) const;
  /// Finds the impulses for velocity changes `dv`. Drops contacts that would pull, and those whose
  /// points would leave each other. Then the equation must be solved again. Returns whether there
  /// were any.
  bool drop_unlikely(std::size_t island, const VectorStack& velocity, const VectorStack& dv);
  void drop_all(std::size_t island) { by_island_[island].last = by_island_[island].first; }
  /// Takes the impulses back from the nodes in contact.
  void remove_impulses(VectorStack& dv) const;

 private:
  // A contact as it was in the last step.
  struct Taken {
    const btCollisionObject* rigid;           // null if both bodies are soft
    btTransform pose;                         // of it
    btVector3 point;                          // of the contact, metres
    std::array<const btSoftBody*, 4> bodies;  // by vertex; null: a vertex of something rigid
    std::array<int, 4> nodes;                 // by vertex; index in its body
    std::array<btVector3, 4> positions;       // of the nodes, metres
    std::array<btScalar, 4> weights;
    btVector3 normal, friction;  // unit vector; newtons
    btScalar force, speed;       // along the normal: newtons; m/s
  };
  // A contact in the numbers of this step. Vertices that cannot move are left out.
  struct Selected : ContactPenalties::Row {
    std::array<int, 4> bodies;  // index in the list of bodies
    std::array<btScalar, 4> inverse_masses;
    btVector3 friction;       // N s
    btScalar impulse, speed;  // of the last step, N s; m/s
    btScalar total;           // impulse in the solution, N s
    bool is_likely;           // whether it may act as the solution says
  };

  // Elements of selected_.
  struct Range {
    std::size_t first, last;
  };

  using Pair = std::pair<const btSoftBody*, const btCollisionObject*>;

  // Whether what the contact touched is still there, or has moved on from there.
  bool stays(const Taken& taken, btScalar dt) const;
  Span<const Selected> of_island(std::size_t island) const {
    const Range range = by_island_[island];
    return {selected_.data() + range.first, range.last - range.first};
  }
  bool number(const Taken& taken, Span<const std::pair<const btSoftBody*, int>> index,
              const Bodies& bodies, const std::vector<btScalar>& inverse_mass, btScalar dt,
              Selected& contact) const;

  btScalar jump_speed_;
  std::vector<Taken> taken_;
  std::vector<Selected> selected_;
  std::vector<Range> by_island_;                   // contacts that were not dropped
  std::vector<Pair> met_;                          // sorted by select()
  std::mutex mutex_;                               // for meet()
  std::vector<const btSoftBody::Node*> anchored_;  // sorted
  VectorStack probe_, product_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
