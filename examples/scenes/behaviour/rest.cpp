// Bodies that are dropped or hit, and are to come to rest.
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <cmath>

#include "scenes/behaviour/behaviour.h"
#include "scenes/behaviour/bodies.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::scenes::behaviour {
namespace {

constexpr double drop = 0.5;  // m

void watch_drop(Application& application, Watch& watch) {
  // sqrt(2 g h) = 3.1 m/s; a node of an elastic body may spring back at twice the speed.
  watch_fastest_node(watch, 6.3);
  watch_rest(watch, 5);
  watch_sticking_edges(watch, application);
}

void build_ball(Application& application, Watch& watch) {
  add_ground(application);
  constexpr double radius = 0.3;
  add(application, Ball{vector(0, radius + drop, 0), radius});
  watch_drop(application, watch);
}

// A closed ring with shape matching.
void build_torus(Application& application, Watch& watch) {
  add_ground(application);
  constexpr int around = 24, across = 12;
  constexpr double large = 0.35, small = 0.14;  // m
  constexpr double turn = 2 * 3.14159265358979323846;
  std::vector<btScalar> vertices;
  std::vector<int> triangles;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double a = turn * i / around, b = turn * j / across;
      const double out = large + small * std::cos(b);
      const btVector3 x = vector(out * std::cos(a), small * std::sin(b), out * std::sin(a));
      // Tilted, so that it lands on its side.
      const btVector3 tilted =
          x.rotate(btVector3(0, 0, 1), scalar(0.5)) + vector(0, 0.35 + drop, 0);
      for (int k = 0; k < 3; ++k) vertices.push_back(tilted[k]);
      const int i1 = (i + 1) % around, j1 = (j + 1) % across;
      const int n00 = i * across + j, n10 = i1 * across + j, n01 = i * across + j1,
                n11 = i1 * across + j1;
      for (const int corner : {n00, n01, n11, n00, n11, n10}) triangles.push_back(corner);
    }
  }
  std::unique_ptr<btSoftBody> ring(
      btSoftBodyHelpers::CreateFromTriMesh(application.info(), vertices.data(), triangles.data(),
                                           static_cast<int>(triangles.size() / 3), false));
  ring->generateBendingConstraints(2);
  ring->setTotalMass(1, true);
  ring->m_cfg.kDF = scalar(0.5);
  ring->m_cfg.kMT = scalar(0.05);
  ring->setPose(false, true);
  application.add(std::move(ring));
  watch_drop(application, watch);
}

// Sticks that stand on the ground; a heavy ball rolls through them.
void build_sticks(Application& application, Watch& watch) {
  add_ground(application);
  constexpr int side = 8, nodes = 5;
  constexpr double spacing = 0.25, height = 0.6, rolling = 4;
  for (int i = 0; i < side * side; ++i) {
    const btVector3 foot = vector(spacing * (i % side - 3.5), 0.02, spacing * (i / side - 3.5));
    auto stick = make_rope(application.info(), nodes, 0.01, foot, foot + vector(0, height, 0));
    stick->setMass(0, 0);
    stick->generateBendingConstraints(3);
    stick->m_cfg.kCHR = scalar(0.1);
    stick->m_cfg.kDP = scalar(0.005);
    application.add(std::move(stick));
  }
  btRigidBody* const ball = application.add(make_sphere(0.4), at(-2, 0.41, 0.05), 50, 1);
  ball->setLinearVelocity(vector(rolling, 0, 0));
  ball->setAngularVelocity(vector(0, 0, -rolling / 0.4));
  // What a heavy ball hits leaves at up to twice the speed of its surface, which is twice `rolling`
  // at the top.
  watch_fastest_node(watch, 4 * rolling);
  watch_sticking_edges(watch, application);
}

}  // namespace

std::vector<Behaviour> rest_behaviours() {
  std::vector<Behaviour> scenes;
  const auto add = [&](const char* name, const char* description, double seconds,
                       void (*build)(Application&, Watch&)) {
    scenes.push_back(make_behaviour(name, description, seconds, build));
  };
  add("rest-ball", "a soft ball is dropped on a ground", 8, build_ball);
  scenes.back().rigid_substeps = 4;
  add("rest-torus", "a soft ring is dropped on a ground", 8, build_torus);
  add("sticks", "a heavy ball rolls through standing sticks", 3, build_sticks);
  scenes.back().on_curve = true;
  scenes.back().in_deformable_world = false;  // ropes cannot stand there
  return scenes;
}

}  // namespace lazyccd::scenes::behaviour
