// A scene in which a cloth collides with itself.
#include <cmath>

#include "scenes/measures/sides.h"
#include "scenes/meshes/cloth.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {
namespace {

constexpr int columns = 15;
constexpr int layer_rows = 20, turn_rows = 7;  // 47 rows: lower layer, turn, upper layer
constexpr double gap = 0.1;                    // m, between the layers
constexpr double spacing = 1.0 / (columns - 1);

// Returns the position at (u, v) on the folded strip: straight out, half a circle, straight back.
btVector3 folded(double u, double v) {
  constexpr double pi = 3.14159265358979323846;
  const double row = v * (2 * layer_rows + turn_rows - 1);
  double along, height;
  if (row <= layer_rows - 1) {
    along = row * spacing;
    height = 0;
  } else if (row >= layer_rows + turn_rows) {
    along = (2 * layer_rows + turn_rows - 1 - row) * spacing;
    height = gap;
  } else {
    const double angle = pi * (row - (layer_rows - 1)) / (turn_rows + 1);
    along = (layer_rows - 1) * spacing + 0.5 * gap * std::sin(angle);
    height = 0.5 * gap * (1 - std::cos(angle));
  }
  return btVector3(static_cast<btScalar>(u), static_cast<btScalar>(height),
                   static_cast<btScalar>(along));
}

void build_fold(Scene& scene, const Parameters& parameters, double speed) {
  PhysicsWorld& world = *scene.world;
  std::mt19937 random(parameters.seed);
  constexpr int rows = 2 * layer_rows + turn_rows;
  auto strip = make_cloth(world.info(), columns, rows, 1, [&](double u, double v) {
    // Random offsets, because on a regular grid the nodes of the layers would meet exactly.
    const btScalar aside = static_cast<btScalar>(0.002 * (random() / 4294967296.0));
    return folded(u, v) + btVector3(aside, 0, -aside);
  });
  constexpr int first_upper = columns * (layer_rows + turn_rows), last = columns * rows - 1;
  pin(*strip, 0, columns * layer_rows - 1);
  for (int i = first_upper; i <= last; ++i) {
    strip->m_nodes[i].m_v = btVector3(0, static_cast<btScalar>(-speed), 0);
  }
  strip->setSelfCollision(true);
  const btSoftBody* body = strip.get();
  world.add(std::move(strip));
  scene.nodes_on_wrong_side = [body] {
    // Counts nodes below the pinned layer, not beside it. The rim is left out, because random
    // offsets make the border of the layer uneven.
    constexpr double rim = 0.01, length = (layer_rows - 1) * spacing;
    int below = 0;
    for (int i = first_upper; i <= last; ++i) {
      const btVector3& x = body->m_nodes[i].m_x;
      const double along = static_cast<double>(x.z()), across = static_cast<double>(x.x());
      below += x.y() < 0 && across > rim && across < 1 - rim && along > rim && along < length - rim;
    }
    return below;
  };
}

}  // namespace

std::vector<SceneInfo> fold_scenes() {
  SceneInfo fold;
  fold.name = "fold";
  fold.description = "the upper layer of a folded strip of cloth flies at its pinned lower layer";
  fold.speed = 5;
  fold.distance = 0.3;
  fold.seconds = 0.2;
  fold.build = build_fold;
  return {fold};
}

}  // namespace lazyccd::scenes
