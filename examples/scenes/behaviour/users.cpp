// What users of Bullet ask for in its forum and reports: dispatchers, shapes, anchors, forces.
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>
#include <cmath>

#include "scenes/behaviour/behaviour.h"
#include "scenes/behaviour/bodies.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"

namespace lazyccd::scenes::behaviour {
namespace {

void build_threads(Application& application, Watch& watch) {
  add_ground(application);
  for (int i = 0; i < 4; ++i)
    application.add(make_box(0.4, 0.4, 0.4), at(i % 2 - 0.5, 0.21, i / 2 - 0.5), 1);
  for (int i = 0; i < 4; ++i) add(application, Cloth{11, 1.2, 0.5 + 0.1 * i, 0.4});
  watch_sticking_edges(watch, application);
  watch_fastest_node(watch, 6);
}

// A GImpact mesh that owns its triangles. They are in a base class, to be there first.
struct OwnedTriangles {
  btTriangleMesh triangles;
};
class Rock : private OwnedTriangles, public btGImpactMeshShape {
 public:
  explicit Rock(const Triangles& surface)
      : OwnedTriangles{}, btGImpactMeshShape(filled(triangles, surface)) {
    setMargin(scalar(0.01));
    updateBound();
  }

 private:
  static btTriangleMesh* filled(btTriangleMesh& triangles, const Triangles& surface) {
    const auto& x = surface.vertices;
    for (const Face& face : surface.faces)
      triangles.addTriangle(x[face[0]], x[face[1]], x[face[2]]);
    return &triangles;
  }
};

void build_gimpact(Application& application, Watch& watch) {
  btGImpactCollisionAlgorithm::registerAlgorithm(
      &static_cast<btCollisionDispatcher&>(application.dispatcher()));
  add_ground(application);
  // A faceted ball.
  constexpr int rings = 6, sectors = 10;
  Triangles surface;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const double a = 3.14159265358979323846 * i / rings,
                   b = 2 * 3.14159265358979323846 * j / sectors;
      surface.vertices.push_back(vector(0.3 * std::sin(a) * std::cos(b), 0.3 * std::cos(a),
                                        0.3 * std::sin(a) * std::sin(b)));
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const int n00 = i * sectors + j, n01 = i * sectors + (j + 1) % sectors;
      const int n10 = n00 + sectors, n11 = n01 + sectors;
      if (i > 0) surface.faces.push_back({n00, n01, n11});
      if (i + 1 < rings) surface.faces.push_back({n00, n11, n10});
    }
  }
  application.add(std::make_unique<Rock>(surface), at(0, 0.32, 0), 2);
  add(application, Cloth{21, 1.4, 0.8});
  watch_sticking_edges(watch, application);
  watch_fastest_node(watch, 6);
}

// A cloth hangs on a body that flies into a wall.
void build_anchored(Application& application, Watch& watch) {
  application.add(make_box(0.4, 4, 4), at(1.5, 0, 0), 0);
  application.add(make_box(6, 0.4, 6), at(0, -0.8, 0), 0, 1);
  constexpr int nodes = 13;
  btSoftBody* const cloth = add(application, Cloth{nodes, 0.8, 0, 0.3});
  constexpr double speed = 4;
  btRigidBody* const body = application.add(make_box(0.2, 0.2, 1), at(0.55, 0, 0), 2);
  for (int row = 0; row < nodes; row += 3) {
    const int node = row * nodes + nodes - 1;
    if (application.is_rigid()) {
      cloth->appendAnchor(node, body, true);
    } else {
      cloth->appendDeformableAnchor(node, body);
    }
  }
  application.do_not_count(body);
  body->setLinearVelocity(vector(speed, 0, 0));
  cloth->setVelocity(vector(speed, 0, 0));
  // The cloth swings around the stopped body: at most twice the speed, and what falling adds.
  watch_fastest_node(watch, 2 * speed + 5);
  watch_sticking_edges(watch, application);
}

void build_pressed(Application& application, Watch& watch) {
  add_ground(application);
  constexpr double radius = 0.3;
  add(application, Ball{vector(0, radius + 0.02, 0), radius, 0.5});
  btRigidBody* const weight =
      application.add(make_box(0.8, 0.2, 0.8), at(0, 2 * radius + 0.15, 0), 5, 1);
  weight->setAngularFactor(0);
  watch.figures.push_back([=] {
    Figure figure{"room between ground and weight at the end, m",
                  static_cast<double>(weight->getCenterOfMassPosition().y()) - 0.1};
    // The pressure (kPR / volume, or the modulus) carries 49 N with less than half of the ball's
    // cross-section, so that more than half of its height stays.
    figure.at_least = radius;
    return figure;
  });
  watch_sticking_edges(watch, application);
  watch_fastest_node(watch, 10);
}

void build_forces(Application& application, Watch& watch) {
  add_ground(application);
  constexpr double mass = 1;
  add(application, Cloth{15, 1, 0.03, mass});
  const auto sum = std::make_shared<double>(0);
  const auto count = std::make_shared<int>(0);
  const double dt = frame_seconds / application.settings().substeps;
  watch.after_step.push_back([=, &application](const State&, double time) {
    if (time < 2) return;
    ++*count;
    for (const bullet::StepContact& contact : application.contacts()) {
      const btVector3 impulse = scalar(contact.impulse) * contact.normal + contact.friction_impulse;
      // The impulse acts from b on a.
      const bool soft_first = btSoftBody::upcast(contact.body_a) != nullptr;
      *sum += static_cast<double>(impulse.y()) / dt * (soft_first ? 1 : -1);
    }
  });
  const bool lazy = application.settings().collisions == Collisions::lazyccd;
  const double weight = mass * application.settings().gravity;
  watch.figures.push_back([=] {
    Figure figure{"mean contact force that is reported, % of the weight",
                  lazy && *count > 0 ? 100 * *sum / *count / weight : 0};
    figure.at_least = 95;
    figure.at_most = 105;
    return figure;
  });
}

// A light sphere carries a node of a cloth that starts folded in itself.
void build_carrier(Application& application, Watch& watch) {
  constexpr int columns = 11, rows = 31;
  auto strip = make_cloth(application.info(), columns, rows, 0.3, [](double u, double v) {
    // A lying eight, one and a quarter times: it crosses itself in the middle and at its end.
    const double angle = 2.5 * 3.14159265358979323846 * (v + 0.1);
    return vector(0.4 * (u - 0.5) + 0.01 * v, 0.08 * std::sin(2 * angle) + 0.01 * v,
                  (0.2 - 0.02 * v) * std::sin(angle));
  });
  strip->setSelfCollision(true);
  btSoftBody* const cloth = application.add(std::move(strip));
  const int held = columns / 2;
  btRigidBody* const sphere = application.add(
      make_sphere(0.02), btTransform(btQuaternion::getIdentity(), cloth->m_nodes[held].m_x), 0.1);
  sphere->setIgnoreCollisionCheck(cloth, true);
  cloth->setIgnoreCollisionCheck(sphere, true);
  application.do_not_count(sphere);
  application.hold(sphere);
  cloth->appendDeformableAnchor(held, sphere);
  const auto fastest = std::make_shared<double>(0);
  watch.after_step.push_back([=](const State&, double) {
    *fastest = std::max(*fastest, static_cast<double>(sphere->getAngularVelocity().length()));
  });
  watch.figures.push_back([=] {
    Figure figure{"angular speed of the carrier, rad/s", *fastest};
    // What acts on its centre cannot turn it. With Bullet alone it does not turn at all.
    figure.at_most = 0.1;
    return figure;
  });
  watch_sticking_edges_at(watch, application, 0);
  // It swings below the sphere.
  watch_fastest_node(watch, 20);
}

}  // namespace

std::vector<Behaviour> user_behaviours() {
  std::vector<Behaviour> scenes;
  const auto add = [&](const char* name, const char* description, double seconds,
                       void (*build)(Application&, Watch&)) {
    scenes.push_back(make_behaviour(name, description, seconds, build));
  };
  add("threaded-dispatcher", "cloths fall on boxes with btCollisionDispatcherMt", 2, build_threads);
  scenes.back().threaded_dispatcher = true;
  scenes.back().on_curve = true;
  add("gimpact", "a cloth falls on a dynamic GImpact mesh", 2, build_gimpact);
  scenes.back().on_curve = true;
  add("anchored-cloth", "a cloth hangs on a body that flies into a wall", 2, build_anchored);
  scenes.back().on_curve = true;
  add("pressed-ball", "a soft ball under a weight of ten times its mass", 3, build_pressed);
  scenes.back().rigid_substeps = 4;
  add("contact-forces", "a cloth rests, and its contacts tell its weight", 4, build_forces);
  add("carrier", "a light sphere carries a node of a cloth that is folded in itself", 2,
      build_carrier);
  scenes.back().in_rigid_world = false;
  return scenes;
}

}  // namespace lazyccd::scenes::behaviour
