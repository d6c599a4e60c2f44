// Counts what passed through what, from the positions that Bullet holds alone.
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

class PenetrationCheck {
 public:
  using SoftBodies = std::vector<std::unique_ptr<btSoftBody>>;
  struct Obstacle {
    const btCollisionObject* body;
    const scenes::Triangles* surface;
    bool driven;  // by what gives way to nothing: kinematic, a link of a multi-body, put elsewhere
  };

  static bool is_clean(const SoftBodies& soft, const std::vector<Obstacle>& obstacles);

  // Begins anew with these bodies where they are.
  void restart(const SoftBodies& soft, std::vector<Obstacle> obstacles);
  // Of what is apart from kinematic bodies and links of multi-bodies, and of these: where one
  // closes in on what cannot give way, Bullet's goes on.
  struct Count {
    std::int64_t others = 0, with_driven = 0;
    std::int64_t sum() const { return others + with_driven; }
  };
  // Pairs that the straight motion since the last call brought into contact. Not those of which
  // nothing can move.
  Count step();
  Count intersections() const;
  int vertex_count() const { return static_cast<int>(last_.size() / 3); }
  const std::vector<Contact>& crossings() const { return crossings_; }
  const scenes::Surface& surface() const { return surface_; }

 private:
  void read();
  std::vector<btScalar> positions() const;
  void add(std::int32_t body_a, std::int32_t body_b, Count& count) const;
  // Not where a filter, a flag or an anchor keeps a pair apart from each other's contacts.
  void read_pairs();

  const SoftBodies* soft_ = nullptr;
  std::vector<Obstacle> obstacles_;
  scenes::Surface surface_;
  std::vector<char> driven_;             // by body
  std::vector<std::vector<char>> meet_;  // by both bodies
  Detector detector_;
  std::vector<btScalar> last_;
  std::vector<Contact> crossings_;
};

}  // namespace lazyccd::test
