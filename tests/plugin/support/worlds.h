// Impact: a small world with two sheets, for tests of the adapter.
#pragma once

#include <memory>
#include <random>

#include "scenes/measures/crossings.h"
#include "scenes/measures/sides.h"
#include "scenes/meshes/cloth.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::test {

using scenes::Collisions;
using scenes::PhysicsWorld;
using scenes::World;

inline scenes::WorldOptions quiet_options(World world, double dt = 1.0 / 240) {
  scenes::WorldOptions options;
  options.world = world;
  options.dt = dt;
  options.lazyccd.measure_energy = true;
  return options;
}

inline void throw_down(btSoftBody& body, double speed) {
  body.setVelocity(btVector3(0, static_cast<btScalar>(-speed), 0));
}

/// A square sheet of `nodes` x `nodes` nodes at `height`.
inline std::unique_ptr<btSoftBody> sheet(PhysicsWorld& world, int nodes, double width,
                                         double height, double angle = 0.3) {
  std::mt19937 random(static_cast<unsigned>(nodes));
  scenes::Sheet s{nodes, nodes, width, width};
  s.height = height;
  s.angle = angle;
  s.jitter = 0.002;
  return scenes::make_sheet(world.info(), s, random);
}

/// A sheet flies down to a larger one that is pinned at its border.
struct Impact {
  std::unique_ptr<PhysicsWorld> world;
  btSoftBody* held;
  btSoftBody* thrown;

  explicit Impact(const scenes::WorldOptions& options, double speed = 10, int group = 1,
                  int mask = -1)
      : world(PhysicsWorld::make(options)) {
    auto lower = sheet(*world, 9, 2, 0, 0);
    auto upper = sheet(*world, 6, 1, 0.1);
    held = lower.get();
    thrown = upper.get();
    scenes::pin_border(*held, 9, 9);
    throw_down(*thrown, speed);
    world->add(std::move(lower));
    world->add(std::move(upper), group, mask);
  }

  /// Number of nodes of the thrown sheet that are below the held one.
  int passed() const { return scenes::nodes_below(*thrown, 0, thrown->m_nodes.size() - 1, *held); }
  void steps(int count) {
    for (int i = 0; i < count; ++i) world->step();
  }
};

}  // namespace lazyccd::test
