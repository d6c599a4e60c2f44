// Watches an application from outside: pass-throughs, edges that stick, speeds and energy. It reads
// only Bullet's objects, not LazyCCD.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "scenes/behaviour/application.h"
#include "scenes/measures/crossings.h"

namespace lazyccd::scenes::behaviour {

/// Energy and momentum of everything that moves freely.
struct State {
  double kinetic_energy = 0;    // J
  double potential_energy = 0;  // J, of gravity; 0 at y = 0
  btVector3 momentum{0, 0, 0};  // kg m/s
  double fastest_node = 0;      // m/s, of nodes that are not pinned
  bool finite = true;           // all positions

  double energy() const { return kinetic_energy + potential_energy; }
};

State read_state(const Application& application);

/// Largest speed of a node that is not pinned, m/s.
double fastest_node(const btSoftBody& body);
/// Mean position of the nodes.
btVector3 middle_of(const btSoftBody& body);
/// Height of the lowest or highest node, metres.
double lowest_node(const btSoftBody& body);
double highest_node(const btSoftBody& body);

/// Edges that pass through faces now, of bodies that may collide by the filters. Infinite if a
/// position is not finite.
double sticking_edges(const Application& application);

/// Counts pass-throughs over the substeps.
class Observer {
 public:
  explicit Observer(const Application& application);
  /// Call it after each substep. `jump`: something was put elsewhere; the substep is not counted.
  void step(bool jump);

  std::int64_t pass_throughs() const;

 private:
  const Application& application_;
  CrossingCounter counter_;
};

}  // namespace lazyccd::scenes::behaviour
