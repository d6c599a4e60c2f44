// Scenes that start intersecting, as applications do by mistake or for convenience.
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <cmath>

#include "scenes/behaviour/behaviour.h"
#include "scenes/behaviour/bodies.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"

namespace lazyccd::scenes::behaviour {
namespace {

// 5 m/s: coming out of each other must not throw anything. It is what falls 1.3 m.
constexpr double calm = 5;

void watch_edges(Watch& watch, Application& application, double fastest = calm, int sticking = 0) {
  watch_sticking_edges_at(watch, application, 0);
  watch_sticking_edges_at(watch, application, 1);
  watch_sticking_edges(watch, application, sticking);
  watch_fastest_node(watch, fastest);
}

void build_box_through_cloth(Application& application, Watch& watch) {
  constexpr int nodes = 21;
  constexpr double box = 1;
  btSoftBody* const cloth = add(application, Cloth{nodes, 3, 0, 0.3, 8});
  for (const int corner : {0, nodes - 1, nodes * (nodes - 1), nodes * nodes - 1})
    cloth->setMass(corner, 0);
  application.add(make_box(box, box, box), at(0, 0.5 * box - 0.3, 0), 0.2);
  // This cloth alone, without the box, sags at up to 6 m/s.
  watch_edges(watch, application, 8);
}

void build_cloth_through_box(Application& application, Watch& watch) {
  application.add(make_box(0.4, 0.4, 0.4), at(0, 0, 0));
  application.add(make_box(4, 0.2, 4), at(0, -0.3, 0));
  add(application, Cloth{17, 1.2, 0.12, 0.3});
  watch_edges(watch, application);
}

void build_ball_in_plane(Application& application, Watch& watch) {
  application.add(std::make_unique<btStaticPlaneShape>(vector(0, 1, 0), btScalar(0)), at(0, 0, 0));
  btSoftBody* const ball = add_shell(application, vector(0, 0.2, 0), 0.3);
  watch.figures.push_back([ball] {
    Figure figure{"lowest node above the plane at the end, m", lowest_node(*ball)};
    figure.at_least = -0.001;  // a tenth of the margin
    return figure;
  });
  watch_fastest_node(watch, calm);
}

void build_ball_in_ball(Application& application, Watch& watch) {
  add_ground(application);
  add_shell(application, vector(-0.25, 0.32, 0), 0.3);
  add_shell(application, vector(0.25, 0.33, 0.03), 0.3);
  watch_edges(watch, application);
}

// A strip whose last row is held by a body below the strip's own middle.
void build_held_in_itself(Application& application, Watch& watch) {
  constexpr int columns = 9, rows = 31;
  constexpr double width = 0.4, spacing = 0.05;
  // Out along z, a half circle down and back; its end then rises through the upper layer.
  auto strip = make_cloth(application.info(), columns, rows, 0.3, [](double u, double v) {
    constexpr double pi = 3.14159265358979323846, radius = 0.1, straight = 0.6;
    const double length = v * spacing * (rows - 1);
    const double turn = pi * radius;
    double y, z;
    if (length < straight) {
      y = 0;
      z = length;
    } else if (length < straight + turn) {
      const double angle = (length - straight) / radius;
      y = -radius + radius * std::cos(angle);
      z = straight + radius * std::sin(angle);
    } else {
      const double back = length - straight - turn;
      y = -2 * radius + back * 0.4;
      z = straight - back * 0.9;
    }
    return vector(width * (u - 0.5) + 0.001 * v, y + 1, z);
  });
  pin(*strip, 0, columns - 1);
  strip->setSelfCollision(true);
  btSoftBody* const cloth = application.add(std::move(strip));
  const int last = columns * (rows - 1) + columns / 2;
  btRigidBody* const holder =
      application.add(make_box(0.02, 0.02, 0.02),
                      btTransform(btQuaternion::getIdentity(), cloth->m_nodes[last].m_x));
  holder->setCollisionFlags(holder->getCollisionFlags() |
                            btCollisionObject::CF_NO_CONTACT_RESPONSE);
  if (application.is_rigid()) {
    cloth->appendAnchor(last, holder, true);
  } else {
    cloth->appendDeformableAnchor(last, holder);
  }
  application.do_not_count(holder);
  // The strip falls by its length of 1.5 m at most, and its springs throw its loop further.
  // An open surface has no inside to come out of; its crossings must not grow.
  watch_edges(watch, application, 8, 31);
}

}  // namespace

std::vector<Behaviour> start_behaviours() {
  std::vector<Behaviour> scenes;
  const auto add = [&](const char* name, const char* description,
                       void (*build)(Application&, Watch&)) {
    Behaviour scene;
    scene.name = std::string("start-") + name;
    scene.description = description;
    scene.seconds = 3;
    scene.build = build;
    scenes.push_back(scene);
  };
  add("box-through-cloth", "a light box starts 0.3 m through a cloth pinned at its corners",
      build_box_through_cloth);
  add("cloth-through-box", "a cloth starts across a static box", build_cloth_through_box);
  add("ball-in-plane", "a closed soft ball starts 0.1 m deep in a plane", build_ball_in_plane);
  add("ball-in-ball", "two closed soft balls start 0.1 m in each other", build_ball_in_ball);
  add("held-in-itself", "a strip starts through itself, and a node there is anchored",
      build_held_in_itself);
  return scenes;
}

}  // namespace lazyccd::scenes::behaviour
