// The five scenes of the page, in the rigid world at 60 steps a second.
#pragma once

#include <vector>

#include "scenes/scene.h"

namespace lazyccd::web {

/// In the order in which the page lists them. Two are of the library (scenes/library).
std::vector<scenes::SceneInfo> page_scenes();

/// Sets up a scene. `speed` in m/s; `size` multiplies the number of nodes along each side.
scenes::Scene set_up(const scenes::SceneInfo& info, scenes::Collisions collisions, double speed,
                     double size);

}  // namespace lazyccd::web
