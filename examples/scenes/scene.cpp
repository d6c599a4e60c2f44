#include "scenes/scene.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::scenes {

int scaled(int nodes, const Parameters& parameters) {
  return std::max(2, static_cast<int>(std::lround(nodes * parameters.size)));
}

const std::vector<SceneInfo>& all_scenes() {
  static const std::vector<SceneInfo> scenes = [] {
    std::vector<SceneInfo> all;
    for (const auto& part : {impact_scenes(), fold_scenes(), pile_scenes(), rope_scenes(),
                             solid_scenes(), obstacle_scenes()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return scenes;
}

const SceneInfo* find_scene(const std::string& name) {
  const auto& scenes = all_scenes();
  const auto found = std::find_if(scenes.begin(), scenes.end(),
                                  [&](const SceneInfo& scene) { return scene.name == name; });
  return found == scenes.end() ? nullptr : &*found;
}

Scene set_up(const SceneInfo& info, const Parameters& parameters) {
  WorldOptions options;
  options.world = parameters.world;
  options.collisions = parameters.collisions;
  options.dt = parameters.dt.value_or(1.0 / 240);
  options.gravity = info.gravity;
  options.margin = parameters.margin.value_or(info.margin);
  options.lazyccd = parameters.lazyccd;
  const double speed = parameters.speed.value_or(info.speed);
  const double flight = speed > 0 ? info.distance / speed : 0;

  Scene scene;
  scene.world = PhysicsWorld::make(options);
  scene.steps =
      parameters.steps.value_or(static_cast<int>(std::ceil((info.seconds + flight) / options.dt)));
  info.build(scene, parameters, speed);
  return scene;
}

}  // namespace lazyccd::scenes
