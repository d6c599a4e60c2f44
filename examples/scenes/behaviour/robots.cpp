// Multibodies: links that fall on cloth, grip it, hold it or push soft bodies.

#include <algorithm>
#include <cmath>
#include <memory>

#include "scenes/behaviour/behaviour.h"
#include "scenes/behaviour/bodies.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"

namespace lazyccd::scenes::behaviour {
namespace {

double step_of(const Application& application) {
  return frame_seconds / application.settings().substeps;
}

void build_chain(Application& application, Watch& watch) {
  constexpr int nodes = 15;
  auto cloth = make(application, Cloth{nodes, 3});
  pin_border(*cloth, nodes, nodes);
  application.add(std::move(cloth), 0.01, 6);
  std::vector<BoxLink> links(4);
  for (int i = 0; i < 4; ++i) {
    links[i].parent = i - 1;
    links[i].joint = Joint::revolute;
    links[i].axis = btVector3(1, 0, 0);
    links[i].pivot = links[i].centre = vector(0, 0, 0.14);
    links[i].size = vector(0.2, 0.1, 0.26);
    links[i].mass = 0.2;
  }
  Multibody* const chain = application.add(
      std::make_unique<Multibody>(vector(0, 0.6, -0.5), vector(0.2, 0.1, 0.26), 0.2, false, links));
  // It falls 0.6 m and 1 m with the cloth: 5.6 m/s, and the last link of a chain may whip.
  const auto fastest = std::make_shared<double>(0);
  watch.after_step.push_back([=](const State&, double time) {
    if (time > 0.4) *fastest = std::max(*fastest, chain->fastest_link());
  });
  watch.figures.push_back([=] {
    Figure figure{"fastest link after contact, m/s", *fastest};
    figure.at_most = 8.4;
    return figure;
  });
  // 1 % of m g h, h the fall to the cloth.
  watch_energy(watch, application, 0.06);
  watch_sticking_edges(watch, application);
}

// A tent of cloth whose ridge is held until a hand has taken it and lifts it.
void build_gripper(Application& application, Watch& watch) {
  add_ground(application);
  constexpr int nodes = 17;
  auto tent = make_cloth(application.info(), nodes, nodes, 0.2, [](double u, double v) {
    const double along = v - 0.5;
    return vector(0.6 * (u - 0.5), 0.02 + 0.35 * (1 - 2 * std::abs(along)), 0.7 * along);
  });
  tent->m_cfg.kDF = 1;
  btSoftBody* const cloth = application.add(std::move(tent));
  const int ridge = nodes * (nodes / 2);
  const btScalar node_mass = cloth->getMass(ridge);
  pin(*cloth, ridge, ridge + nodes - 1);
  application.call_at(1, [=] {
    for (int i = ridge; i < ridge + nodes; ++i) cloth->setMass(i, node_mass);
  });

  std::vector<BoxLink> links(3);
  links[0].joint = Joint::prismatic;  // lifts
  links[0].axis = btVector3(0, 1, 0);
  links[0].size = vector(0.1, 0.1, 0.1);
  links[0].mass = 1;
  for (int i = 1; i < 3; ++i) {
    const double sign = i == 1 ? -1 : 1;
    links[i].parent = 0;
    links[i].joint = Joint::prismatic;
    links[i].axis = vector(0, 0, -sign);
    links[i].pivot = vector(0, -0.7, sign * 0.25);
    links[i].size = vector(0.3, 0.15, 0.06);
    links[i].mass = 0.5;
  }
  Multibody* const hand = application.add(
      std::make_unique<Multibody>(vector(0, 1, 0), btVector3(0, 0, 0), 1, true, links));
  const double dt = step_of(application);
  btMultiBodyJointMotor* const lift = hand->add_motor(0, 200, dt);
  for (int i = 1; i < 3; ++i) {
    btMultiBodyJointMotor* const close = hand->add_motor(i, 20, dt);
    close->setVelocityTarget(scalar(0.5), 1);
  }
  application.call(Moment::between_steps, [=](double time) {
    lift->setVelocityTarget(time > 1.2 && time < 2.2 ? scalar(0.4) : scalar(0), 1);
  });
  const int middle = ridge + nodes / 2;
  watch.figures.push_back([=] {
    // The ridge starts at 0.37 m and rises by 0.4 m.
    Figure figure{"height of the cloth's middle, m",
                  static_cast<double>(cloth->m_nodes[middle].m_x.y())};
    figure.at_least = 0.5;
    figure.at_most = 0.85;
    return figure;
  });
  // It falls 0.8 m at most, 4 m/s. Its corners swing, at up to twice the speed.
  watch_fastest_node(watch, 8);
}

// The same pillars as links of a robot with fixed joints, or as static bodies.
void build_still(Application& application, Watch& watch, bool as_links) {
  add_ground(application);
  constexpr int count = 6;
  std::vector<BoxLink> links(count);
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / count;
    links[i].pivot = vector(0.5 * std::cos(angle), 0.25 + 0.02 * i, 0.5 * std::sin(angle));
    links[i].size = vector(0.15, 0.5 + 0.04 * i, 0.15);
    if (!as_links) {
      application.add(make_box(0.15, 0.5 + 0.04 * i, 0.15),
                      btTransform(btQuaternion::getIdentity(), links[i].pivot), 0, 1);
    }
  }
  if (as_links) {
    application.add(
        std::make_unique<Multibody>(btVector3(0, 0, 0), btVector3(0, 0, 0), 1, true, links));
  }
  btSoftBody* const cloth = add(application, Cloth{25, 1.6, 0.9});
  // It falls 0.9 m, 4.2 m/s. Its corners swing, at up to twice the speed.
  watch_fastest_node(watch, 8.4);
  watch.figures.push_back([cloth] {
    Figure figure{"highest node at the end, m", highest_node(*cloth)};
    figure.at_least = 0.7;  // the highest pillar
    return figure;
  });
  watch_sticking_edges(watch, application);
}

void build_hand(Application& application, Watch& watch) {
  add_ground(application);
  constexpr double radius = 0.3;
  add(application, Ball{vector(0, radius + 0.02, 0), radius, 0.5, 50, 3000, 1});
  std::vector<BoxLink> links(1);
  links[0].joint = Joint::prismatic;
  links[0].axis = vector(0, -1, 0);
  links[0].size = vector(0.12, 0.4, 0.12);
  links[0].mass = 1;
  Multibody* const hand = application.add(
      std::make_unique<Multibody>(vector(0.03, 0.95, 0.02), btVector3(0, 0, 0), 1, true, links));
  btMultiBodyJointMotor* const push = hand->add_motor(0, 30, step_of(application));
  push->setVelocityTarget(scalar(0.4), 1);
  watch_sticking_edges(watch, application);
  watch_fastest_node(watch, 5);
  watch.figures.push_back([hand] {
    // A motor of 30 N cannot push through the ground.
    const btVector3 tip = hand->body().localPosToWorld(0, vector(0, -0.2, 0));
    Figure figure{"height of the fingertip at the end, m", static_cast<double>(tip.y())};
    figure.at_least = 0;
    return figure;
  });
}

}  // namespace

std::vector<Behaviour> multibody_behaviours() {
  std::vector<Behaviour> scenes;
  const auto add = [&](const char* name, const char* description, double seconds,
                       int rigid_substeps, std::function<void(Application&, Watch&)> build) {
    Behaviour scene;
    scene.name = name;
    scene.description = description;
    scene.seconds = seconds;
    scene.rigid_substeps = rigid_substeps;
    scene.build = std::move(build);
    scenes.push_back(scene);
  };
  add("chain-on-cloth", "a chain of hinged links falls on a pinned cloth", 3, 1, build_chain);
  scenes.back().on_curve = true;
  add("gripper", "two fingers with motors take a cloth and lift it", 2.7, 4, build_gripper);
  add("fixed-robot", "a cloth falls on a robot whose joints are fixed", 2, 1,
      [](Application& a, Watch& w) { build_still(a, w, true); });
  add("fixed-bodies", "the same with static bodies in place of links", 2, 1,
      [](Application& a, Watch& w) { build_still(a, w, false); });
  scenes.back().on_curve = true;
  add("hand-in-ball", "a finger with a motor is pushed into a soft ball", 2, 4, build_hand);
  scenes.back().on_curve = true;
  return scenes;
}

}  // namespace lazyccd::scenes::behaviour
