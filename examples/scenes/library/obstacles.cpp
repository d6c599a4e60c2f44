// Scenes with cloth and rigid bodies: meshes, thin plates, moving and dynamic bodies.
#include <algorithm>
#include <cmath>

#include "scenes/measures/sides.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {
namespace {

constexpr double pi = 3.14159265358979323846;

// Adds a cloth that collides with itself, above the origin. It is rotated, so that its rows do not
// line up with those of a mesh.
btSoftBody* add_sheet(Scene& scene, const Parameters& parameters, int nodes, double width,
                      double height, double speed) {
  std::mt19937 random(parameters.seed);
  const int count = scaled(nodes, parameters);
  Sheet sheet{count, count, width, width};
  sheet.height = height;
  sheet.angle = 0.3;
  sheet.jitter = 0.002;
  auto cloth = make_sheet(scene.world->info(), sheet, random);
  cloth->setSelfCollision(true);
  cloth->setVelocity(vector(0, -speed, 0));
  btSoftBody* body = cloth.get();
  scene.world->add(std::move(cloth));
  return body;
}

// Returns a function that counts the nodes of a body for whose position `wrong` is true.
std::function<int()> counter(const btSoftBody* body,
                             std::function<bool(double x, double y, double z)> wrong) {
  return [=] {
    int count = 0;
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      const btVector3& p = body->m_nodes[i].m_x;
      count +=
          wrong(static_cast<double>(p.x()), static_cast<double>(p.y()), static_cast<double>(p.z()));
    }
    return count;
  };
}

// A cone with a tube below it.
constexpr double cone_height = 0.6, tube_length = 0.4;    // m; they meet at y = 0
constexpr double cone_radius = 0.65, tube_radius = 0.16;  // m

double funnel_radius(double y) {
  return tube_radius + (cone_radius - tube_radius) * std::max(0.0, y / cone_height);
}

void build_funnel(Scene& scene, const Parameters& parameters, double speed) {
  scene.world->add_static(make_mesh(32, 10,
                                    [](double u, double v) {
                                      const double y =
                                          v * (cone_height + tube_length) - tube_length;
                                      // Closes the ring: u = 1 gives the same point as u = 0.
                                      const double angle = u < 1 ? 2 * pi * u : 0;
                                      const double r = funnel_radius(y);
                                      return vector(r * std::cos(angle), y, r * std::sin(angle));
                                    }),
                          at(0, 0, 0));
  const btSoftBody* cloth = add_sheet(scene, parameters, 21, 0.7, 0.55, speed);
  scene.nodes_on_wrong_side = counter(cloth, [](double x, double y, double z) {
    // The mesh has 32 sides and lies within the round funnel. So every counted node is outside it.
    return y < cone_height && y > -tube_length && std::hypot(x, z) > funnel_radius(y) + 1e-5;
  });
}

double wave(double x, double z) { return 0.06 * std::sin(6 * x) * std::cos(5 * z); }

void build_moving_mesh(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  const auto path = [](double time) {
    btTransform pose = at(0.15 * std::sin(5 * time), 0.1 * std::sin(7 * time), 0);
    pose.setRotation(btQuaternion(vector(0, 1, 0), static_cast<btScalar>(1.5 * time)));
    return pose;
  };
  world.add_moving(make_mesh(20, 20,
                             [](double u, double v) {
                               const double x = 2 * u - 1, z = 2 * v - 1;
                               return vector(x, wave(x, z), z);
                             }),
                   path);
  const btSoftBody* cloth = add_sheet(scene, parameters, 21, 1, 0.25, speed);
  scene.nodes_on_wrong_side = [cloth, &world, path] {
    const btTransform back = path(world.time()).inverse();
    return counter(cloth, [back](double x, double y, double z) {
      const btVector3 p = back * vector(x, y, z);
      const double px = static_cast<double>(p.x()), pz = static_cast<double>(p.z());
      // Upper bound of the distance between the quads of the mesh and the wave, metres.
      constexpr double flatness = 0.01;
      return std::abs(px) < 1 && std::abs(pz) < 1 &&
             static_cast<double>(p.y()) < wave(px, pz) - flatness;
    })();
  };
}

void build_plate(Scene& scene, const Parameters& parameters, double speed) {
  constexpr double side = 1.4, thickness = 0.01;
  scene.world->add_static(make_box(side, thickness, side), at(0, -thickness / 2, 0));
  const btSoftBody* cloth = add_sheet(scene, parameters, 21, 1, 0.2, speed);
  scene.nodes_on_wrong_side = counter(cloth, [](double x, double y, double z) {
    return y < -thickness / 2 && std::abs(x) < side / 2 && std::abs(z) < side / 2;
  });
}

// A cloth lies on a table. One of its corners is pulled sideways and down.
void build_table(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  constexpr double side = 1, travel = 1.3;  // m
  world.add_static(make_box(side, 0.1, side), at(0, -0.05, 0));
  const double height = 2 * world.options().margin + 0.01;
  btSoftBody* cloth = add_sheet(scene, parameters, 21, 1.1, height, 0);
  cloth->setMass(0, 0);
  const btVector3 start = cloth->m_nodes[0].m_x;
  const btVector3 aside = vector(start.x(), -0.3, start.z()).normalized();
  world.drive([=, dt = world.options().dt](double time) {
    const double distance = std::min(speed * time, travel);
    steer(cloth->m_nodes[0], start + aside * static_cast<btScalar>(distance), dt);
  });
}

// A rigid ball flies into a pinned cloth.
void build_net(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  btSoftBody* cloth = add_sheet(scene, parameters, 21, 1.5, 0, 0);
  const int nodes = scaled(21, parameters);
  pin_border(*cloth, nodes, nodes);
  btRigidBody& ball = world.add_dynamic(make_sphere(0.2), at(0.03, 0.4, 0.02), 1);
  ball.setLinearVelocity(vector(0, -speed, 0));
  scene.nodes_on_wrong_side = [&ball, cloth] {
    return is_below(ball.getCenterOfMassPosition(), *cloth) ? 1 : 0;
  };
}

SceneInfo scene_of(const char* name, const char* description, double speed, double gravity,
                   double seconds, double distance,
                   void (*build)(Scene&, const Parameters&, double)) {
  SceneInfo info;
  info.name = name;
  info.description = description;
  info.speed = speed;
  info.gravity = gravity;
  info.seconds = seconds;
  info.distance = distance;
  info.build = build;
  return info;
}

}  // namespace

std::vector<SceneInfo> obstacle_scenes() {
  return {
      scene_of("cloth-funnel", "a cloth falls through a funnel made of a static triangle mesh", 1,
               10, 1, 0, build_funnel),
      scene_of("cloth-on-moving-mesh",
               "a cloth falls on a wavy triangle mesh that moves and rotates", 1, 10, 1, 0,
               build_moving_mesh),
      scene_of("cloth-on-plate", "a cloth flies at a plate one centimetre thick", 30, 0, 0.2, 0.5,
               build_plate),
      scene_of("cloth-off-table", "a cloth is pulled off a table by one corner", 2, 10, 0.5, 1.3,
               build_table),
      scene_of("ball-on-net", "a rigid ball flies into a cloth that is pinned along its border", 5,
               0, 0.2, 0.6, build_net),
  };
}

}  // namespace lazyccd::scenes
