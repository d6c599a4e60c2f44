// A gripper of two heavy dynamic bodies whose pose and velocity a callback sets in each step.
#include <algorithm>
#include <array>

#include "scenes/behaviour/behaviour.h"
#include "scenes/behaviour/bodies.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::scenes::behaviour {
namespace {

constexpr double side = 0.5;         // m, of the cube
constexpr double finger = 0.1;       // m, half of a finger's thickness
constexpr double lift_height = 0.5;  // m

// A time and the place of the gripper then; between two of them it moves evenly.
struct Key {
  double time;    // s
  double gap;     // m, between the fingers
  double height;  // m, of the middle of the fingers
};
constexpr std::array<Key, 7> keys = {{{0, 0.8, 0.3},
                                      {0.5, 0.8, 0.3},
                                      {1.0, 0.4, 0.3},
                                      {1.2, 0.4, 0.3},
                                      {2.2, 0.4, 0.3 + lift_height},
                                      {2.8, 0.4, 0.3 + lift_height},
                                      {3.2, 0.8, 0.3 + lift_height}}};

struct Place {
  double gap, height, gap_rate, height_rate;
};

Place place_at(double time) {
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (time >= keys[i].time) continue;
    const Key &a = keys[i - 1], &b = keys[i];
    const double span = b.time - a.time, t = (time - a.time) / span;
    return {a.gap + t * (b.gap - a.gap), a.height + t * (b.height - a.height),
            (b.gap - a.gap) / span, (b.height - a.height) / span};
  }
  return {keys.back().gap, keys.back().height, 0, 0};
}

void set_finger(btRigidBody& body, double sign, const Place& place) {
  const btTransform pose = at(sign * (0.5 * place.gap + finger), place.height, 0);
  body.setWorldTransform(pose);
  body.setInterpolationWorldTransform(pose);
  body.setLinearVelocity(vector(0.5 * sign * place.gap_rate, place.height_rate, 0));
  body.setAngularVelocity(btVector3(0, 0, 0));
}

void build(Application& application, Watch& watch) {
  add_ground(application);
  auto made = make_solid(application.info(), 4, 1, [](double u, double v, double w) {
    return vector(side * (u - 0.5), 0.02 + side * v, side * (w - 0.5));
  });
  made->m_cfg.kDF = 2;
  made->m_cfg.kDP = scalar(0.02);
  btSoftBody* const cube = application.add_solid(std::move(made), 500);
  // Created far away, as applications do before they know the place.
  std::array<btRigidBody*, 2> fingers;
  for (btRigidBody*& body : fingers) {
    body = application.add(make_box(2 * finger, 0.4, 0.6), at(10, 0.3, 0), 1000, 1);
    body->setGravity(btVector3(0, 0, 0));
  }
  const Moment moment = application.is_rigid() ? Moment::before_tick : Moment::in_solver;
  application.call(moment, [&application, fingers, first = true](double time) mutable {
    if (first) application.jumped();
    first = false;
    set_finger(*fingers[0], -1, place_at(time));
    set_finger(*fingers[1], 1, place_at(time));
  });

  // Let go, the cube falls from `lift_height`: at most sqrt(2 g h) = 3.2 m/s and m g h = 5 J. It
  // was squeezed by a fifth of its side, so its corners also spring back, at up to twice that in
  // addition.
  watch_fastest_node(watch, 9.6);
  const auto highest_energy = std::make_shared<double>(0);
  const auto soft_energy = [cube] {
    double energy = 0;
    for (int i = 0; i < cube->m_nodes.size(); ++i) {
      const btSoftBody::Node& node = cube->m_nodes[i];
      energy += 0.5 * static_cast<double>(node.m_v.length2() / node.m_im);
    }
    return energy;
  };
  watch.after_step.push_back(
      [=](const State&, double) { *highest_energy = std::max(*highest_energy, soft_energy()); });
  watch.figures.push_back([=] {
    Figure figure{"kinetic energy of the cube, J", *highest_energy};
    figure.at_most = 10;
    return figure;
  });
  const auto lifted = std::make_shared<double>(0);
  const double start = static_cast<double>(middle_of(*cube).y());
  application.call_at(2.7, [=] { *lifted = static_cast<double>(middle_of(*cube).y()) - start; });
  watch.figures.push_back([=] {
    Figure figure{"the cube is lifted by, m", *lifted};
    figure.at_least = 0.8 * lift_height;
    return figure;
  });
}

}  // namespace

std::vector<Behaviour> grip_behaviours() {
  Behaviour scene;
  scene.name = "grip";
  scene.description = "two heavy bodies, placed by a callback, close on a soft cube and lift it";
  scene.seconds = 4;
  scene.rigid_substeps = 4;
  scene.build = build;
  return {scene};
}

}  // namespace lazyccd::scenes::behaviour
