// The one library of scenes for programs, benches and tests.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {

// What a run may choose. Nothing: the scene's own value.
struct Parameters {
  World world = World::deformable;
  Collisions collisions = Collisions::lazyccd;
  std::optional<double> dt;     // s
  std::optional<double> speed;  // m/s
  std::optional<int> steps;
  unsigned seed = 1;
  std::optional<double> margin;  // m
  double size = 1;               // scales the number of nodes along each side of a cloth
  bullet::SolverOptions lazyccd;
};

// Nodes along a side of a cloth, after Parameters::size.
int scaled(int nodes, const Parameters& parameters);

// A scene that was set up, ready to step.
struct Scene {
  std::unique_ptr<PhysicsWorld> world;
  int steps = 0;
  // Nodes on the wrong side of what they were thrown at; empty where the scene has no such side.
  std::function<int()> nodes_on_wrong_side;
};

struct SceneInfo {
  std::string name;
  std::string description;
  double speed = 0;    // m/s; 0 where nothing is thrown
  double gravity = 0;  // m/s^2
  double margin = 0.01;
  double seconds = 1;   // of the run; thrown: what it takes to fly `distance` is added
  double distance = 0;  // m
  std::function<void(Scene&, const Parameters&, double speed)> build;
};

const std::vector<SceneInfo>& all_scenes();
// Null where there is none of that name.
const SceneInfo* find_scene(const std::string& name);
Scene set_up(const SceneInfo& info, const Parameters& parameters);

// The scenes of one file each.
std::vector<SceneInfo> impact_scenes();
std::vector<SceneInfo> fold_scenes();
std::vector<SceneInfo> pile_scenes();
std::vector<SceneInfo> rope_scenes();
std::vector<SceneInfo> solid_scenes();
std::vector<SceneInfo> obstacle_scenes();

}  // namespace lazyccd::scenes
