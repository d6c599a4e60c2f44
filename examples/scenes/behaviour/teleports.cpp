// Bodies that the application puts elsewhere. Nothing is to be swept along the way.
#include <LinearMath/btMotionState.h>

#include "scenes/behaviour/behaviour.h"
#include "scenes/behaviour/bodies.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"

namespace lazyccd::scenes::behaviour {
namespace {

enum class Kind { dynamic, kinematic, fixed };

constexpr double above = 0.8, below = -1.2;  // m, heights of the box; the cloth is at 0
constexpr double jump_time = 0.2;            // s, before a dynamic box reaches the cloth

// Puts a body elsewhere as Bullet's manual says: pose, interpolated pose and motion state.
void put(btRigidBody& body, const btTransform& pose) {
  body.setWorldTransform(pose);
  body.setInterpolationWorldTransform(pose);
  body.getMotionState()->setWorldTransform(pose);
}

void build(Application& application, Watch& watch, Kind kind, Moment moment) {
  constexpr int nodes = 15;
  auto cloth = make(application, Cloth{nodes, 1.5});
  pin_border(*cloth, nodes, nodes);
  application.add(std::move(cloth));
  auto shape = make_box(0.4, 0.4, 0.4);
  btRigidBody* const body =
      kind == Kind::kinematic
          ? application.add_kinematic(std::move(shape), at(0, above, 0))
          : application.add(std::move(shape), at(0, above, 0), kind == Kind::dynamic ? 1 : 0);
  application.call(moment, [&application, body, kind, done = false](double time) mutable {
    if (done || time < jump_time) return;
    done = true;
    application.jumped();
    put(*body, at(0, below, 0));
    if (kind == Kind::fixed) application.world().updateSingleAabb(body);
  });
  // Bullet sweeps nothing, so that the cloth only sags.
  watch_fastest_node_as_bullet(watch, 0.1);
  watch_sticking_edges(watch, application);
}

}  // namespace

std::vector<Behaviour> teleport_behaviours() {
  const struct {
    const char* name;
    Kind kind;
  } kinds[] = {{"dynamic", Kind::dynamic}, {"kinematic", Kind::kinematic}, {"static", Kind::fixed}};
  const struct {
    const char* name;
    Moment moment;
  } moments[] = {{"between-steps", Moment::between_steps},
                 {"before-tick", Moment::before_tick},
                 {"after-tick", Moment::after_tick},
                 {"in-solver", Moment::in_solver}};
  std::vector<Behaviour> scenes;
  for (const auto& [name, kind] : kinds) {
    for (const auto& [when, moment] : moments) {
      // Static and kinematic bodies are moved between steps, or in the pre-tick callback.
      if (kind != Kind::dynamic && moment != Moment::between_steps && moment != Moment::before_tick)
        continue;
      Behaviour scene;
      scene.name = std::string("teleport-") + name + "-" + when;
      scene.description = std::string("a ") + name +
                          " box is put from above a pinned cloth to "
                          "below it, " +
                          when;
      scene.in_rigid_world = moment != Moment::in_solver;
      scene.seconds = 1.5;
      scene.build = [of_kind = kind, at = moment](Application& a, Watch& w) {
        build(a, w, of_kind, at);
      };
      scenes.push_back(scene);
    }
  }
  return scenes;
}

}  // namespace lazyccd::scenes::behaviour
