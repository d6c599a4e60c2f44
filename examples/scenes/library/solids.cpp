// Scenes with soft bodies of tetrahedra.
#include <algorithm>
#include <cmath>
#include <set>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {
namespace {

int scaled_cells(int cells, const Parameters& parameters) {
  return std::max(1, scaled(cells, parameters));
}

// A bed of square pyramids on a grid.
constexpr int spikes = 6;                             // along a side
constexpr double spacing = 0.2, spike_height = 0.25;  // m

// Returns the height of the bed at a point. A spike has six sides, because make_mesh() divides
// every quad along the same diagonal.
double bed_height(double x, double z) {
  const auto off = [](double a) { return a - spacing * (std::floor(a / spacing) + 0.5); };
  const double dx = off(x), dz = off(z), ax = std::abs(dx), az = std::abs(dz);
  const double away = dx * dz > 0 ? std::max(ax, az) : ax + az;
  return spike_height * std::max(0.0, 1 - away / (spacing / 2));
}

void build_spikes(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  constexpr double half = spikes * spacing / 2;
  const auto bed = [](double u, double v) {
    const double x = 2 * half * u - half, z = 2 * half * v - half;
    // The offset keeps rounding from making the heights of equal valleys different.
    return vector(x, bed_height(x + 1e-9, z + 1e-9), z);
  };
  world.add_static(make_mesh(2 * spikes, 2 * spikes, bed), at(0, 0, 0));
  auto ball =
      make_ball(world.info(), scaled_cells(6, parameters), 1, vector(0.03, 0.62, 0.02), 0.3);
  ball->setVelocity(vector(0, -speed, 0));
  // Only nodes on the surface count; the inner ones cannot touch the bed.
  std::set<const btSoftBody::Node*> surface;
  for (int i = 0; i < ball->m_faces.size(); ++i) {
    for (const btSoftBody::Node* corner : ball->m_faces[i].m_n) surface.insert(corner);
  }
  world.add(std::move(ball));
  scene.nodes_on_wrong_side = [surface] {
    return static_cast<int>(
        std::count_if(surface.begin(), surface.end(), [](const btSoftBody::Node* node) {
          const double x = static_cast<double>(node->m_x.x());
          const double z = static_cast<double>(node->m_x.z());
          return std::abs(x) < half && std::abs(z) < half &&
                 static_cast<double>(node->m_x.y()) < bed_height(x, z) - 1e-6;
        }));
  };
}

// Two blocks. The bottom of the lower one is pinned; the top of the upper one is driven down.
void build_pressed(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  constexpr double side = 0.4, gap = 0.05, travel = 0.25;  // m
  const int cells = scaled_cells(5, parameters), layer = (cells + 1) * (cells + 1);
  const auto block = [&](double height, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    // The third axis of the lattice points up, so each layer of nodes is horizontal.
    return make_solid(world.info(), cells, 1, [=](double u, double v, double w) {
      const double x = side * (u - 0.5), z = side * (0.5 - v);
      return vector(c * x + s * z, height + side * w, c * z - s * x);
    });
  };
  auto lower = block(0, 0), upper = block(side + gap, 0.3);
  pin(*lower, 0, layer - 1);
  const int first = cells * layer;
  pin(*upper, first, first + layer - 1);
  btSoftBody* pressed = upper.get();
  world.add(std::move(lower));
  world.add(std::move(upper));
  const double top = 2 * side + gap;
  world.drive([=, dt = world.options().dt](double time) {
    const double height = top - std::min(speed * time, travel);
    for (int i = first; i < first + layer; ++i) {
      btVector3 goal = pressed->m_nodes[i].m_x;
      goal.setY(static_cast<btScalar>(height));
      steer(pressed->m_nodes[i], goal, dt);
    }
  });
}

// Balls at the corners of two cubes fly towards the common centre of the cubes.
void build_balls(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  std::mt19937 random(parameters.seed);
  const auto jitter = [&random] { return 0.04 * (random() / 4294967296.0 - 0.5); };
  const int cells = scaled_cells(3, parameters);
  const auto add = [&](double x, double y, double z) {
    const btVector3 centre = vector(x + jitter(), y + jitter(), z + jitter());
    auto ball = make_ball(world.info(), cells, 1, centre, 0.12);
    ball->setVelocity(centre.normalized() * static_cast<btScalar>(-speed));
    world.add(std::move(ball));
  };
  for (const double r : {0.25, 0.6}) {
    for (int corner = 0; corner < 8; ++corner) {
      add(corner & 1 ? r : -r, corner & 2 ? r : -r, corner & 4 ? r : -r);
    }
  }
}

}  // namespace

std::vector<SceneInfo> solid_scenes() {
  SceneInfo bed;
  bed.name = "ball-on-spikes";
  bed.description = "a soft ball is thrown down on a bed of spikes";
  bed.speed = 3;
  bed.gravity = 10;
  bed.seconds = 0.6;
  bed.build = build_spikes;

  SceneInfo pressed;
  pressed.name = "pressed-blocks";
  pressed.description = "two soft blocks are pressed against each other";
  pressed.speed = 1;
  pressed.distance = 0.25;
  pressed.seconds = 0.25;
  pressed.build = build_pressed;

  SceneInfo balls;
  balls.name = "n-body";
  balls.description = "sixteen soft balls fly towards their common centre";
  balls.speed = 3;
  balls.distance = 1;
  balls.seconds = 0.3;
  balls.build = build_balls;
  return {bed, pressed, balls};
}

}  // namespace lazyccd::scenes
