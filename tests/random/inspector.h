// Counts what passed through what, from the positions that Bullet holds alone.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "lazyccd/detector.h"
#include "scenes/surface.h"
#include "scenes/tessellation.h"

namespace lazyccd::test {

class Inspector {
 public:
  using SoftBodies = std::vector<std::unique_ptr<btSoftBody>>;
  struct Obstacle {
    const btRigidBody* body;
    const scenes::Triangles* surface;
  };

  static bool is_clean(const SoftBodies& soft, const std::vector<Obstacle>& obstacles);

  // Begins anew with these bodies where they are.
  void restart(const SoftBodies& soft, std::vector<Obstacle> obstacles);
  // Pairs that the straight motion since the last call brought into contact. Not those of which
  // nothing can move.
  std::int64_t step();
  std::int64_t piercings() const;
  int vertex_count() const { return static_cast<int>(last_.size() / 3); }
  const std::vector<Contact>& crossings() const { return crossings_; }
  const scenes::Surface& surface() const { return surface_; }

 private:
  void read();
  std::vector<btScalar> positions() const;

  const SoftBodies* soft_ = nullptr;
  std::vector<Obstacle> obstacles_;
  scenes::Surface surface_;
  Detector detector_;
  std::vector<btScalar> last_;
  std::vector<Contact> crossings_;
};

}  // namespace lazyccd::test
