// PenetrationCheck: counts how often surfaces passed through each other or intersect. It uses
// nothing but the positions that Bullet holds.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "lazyccd/detector.h"
#include "scenes/meshes/surface.h"
#include "scenes/meshes/tessellation.h"

namespace lazyccd::test {

/// Compares the bodies' positions between calls of step(). It keeps references to the bodies:
/// call restart() after bodies were added, removed or changed.
class PenetrationCheck {
 public:
  using SoftBodies = std::vector<std::unique_ptr<btSoftBody>>;
  struct Obstacle {
    const btCollisionObject* body;
    const scenes::Triangles* surface;
    bool driven;  ///< has prescribed motion: kinematic, a multibody link, or moved by hand
  };

  /// True if all positions are finite and no pair that may collide touches or intersects.
  static bool is_clean(const SoftBodies& soft, const std::vector<Obstacle>& obstacles);

  /// Starts again with these bodies at their present positions.
  void restart(const SoftBodies& soft, std::vector<Obstacle> obstacles);
  /// Pairs with a driven body (see Obstacle) are counted separately. If a driven body closes in on
  /// something that cannot move away, Bullet moves it on, and an intersection is no error.
  struct Count {
    std::int64_t others = 0, with_driven = 0;
    std::int64_t sum() const { return others + with_driven; }
  };
  /// Counts the pairs that come into contact on the straight motion since the last call. Does not
  /// count pairs of which no vertex can move.
  Count step();
  /// Counts edges that intersect faces at present; one of the vertices must be movable.
  Count intersections() const;
  int vertex_count() const { return static_cast<int>(last_.size() / 3); }
  /// The contacts of the last step(), including pairs that may not collide.
  const std::vector<Contact>& crossings() const { return crossings_; }
  const scenes::Surface& surface() const { return surface_; }

 private:
  void read();
  std::vector<btScalar> positions() const;
  void add(std::int32_t body_a, std::int32_t body_b, Count& count) const;
  // Fills meet_: false if a filter, a flag or an anchor excludes contacts of the two bodies.
  void read_pairs();

  const SoftBodies* soft_ = nullptr;
  std::vector<Obstacle> obstacles_;
  scenes::Surface surface_;
  std::vector<char> driven_;             // indexed by body
  std::vector<std::vector<char>> meet_;  // indexed by both bodies
  Detector detector_;
  std::vector<btScalar> last_;
  std::vector<Contact> crossings_;
};

}  // namespace lazyccd::test
