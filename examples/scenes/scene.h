// The library of scenes that programs, benches and tests share.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {

/// What a run may choose. An empty value means the scene's own.
struct Parameters {
  World world = World::deformable;
  Collisions collisions = Collisions::lazyccd;
  std::optional<double> dt;     // s
  std::optional<double> speed;  // m/s
  std::optional<int> steps;
  unsigned seed = 1;             // of the random offsets of the nodes
  std::optional<double> margin;  // m
  double size = 1;               // factor of the number of nodes along each side of a cloth
  bullet::SolverOptions lazyccd;
};

/// Returns the number of nodes along a side of a cloth, scaled by Parameters::size; at least 2.
int scaled(int nodes, const Parameters& parameters);

/// A scene that is ready to step.
struct Scene {
  std::unique_ptr<PhysicsWorld> world;
  int steps = 0;
  /// Counts the nodes that are on the wrong side of their target. Empty if a scene has no such
  /// side.
  std::function<int()> nodes_on_wrong_side;
};

/// A scene of the library, before it is set up.
struct SceneInfo {
  std::string name;
  std::string description;
  double speed = 0;      // m/s; 0 if nothing is thrown
  double gravity = 0;    // m/s^2
  double margin = 0.01;  // m, of each body
  double seconds = 1;    // of the run; the time to fly `distance` at `speed` is added
  double distance = 0;   // m
  std::function<void(Scene&, const Parameters&, double speed)> build;
};

const std::vector<SceneInfo>& all_scenes();
/// Returns null if no scene has this name.
const SceneInfo* find_scene(const std::string& name);
/// Builds a scene with the given parameters.
Scene set_up(const SceneInfo& info, const Parameters& parameters);

// Each function returns the scenes of one file of scenes/library.
std::vector<SceneInfo> impact_scenes();
std::vector<SceneInfo> fold_scenes();
std::vector<SceneInfo> pile_scenes();
std::vector<SceneInfo> rope_scenes();
std::vector<SceneInfo> solid_scenes();
std::vector<SceneInfo> obstacle_scenes();

}  // namespace lazyccd::scenes
