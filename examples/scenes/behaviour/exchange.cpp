// Laws of contact: momentum of a collision, and how far things slide.
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <cstdio>

#include "scenes/behaviour/behaviour.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::scenes::behaviour {
namespace {

void build_collision(Application& application, Watch& watch) {
  constexpr double side = 0.5, speed = 2;
  auto made = make_solid(application.info(), 4, 0.5, [](double u, double v, double w) {
    return vector(side * (u - 0.5) - 0.8, side * (v - 0.5) + 0.05, side * (w - 0.5) + 0.03);
  });
  made->m_cfg.kDF = scalar(0.2);
  btSoftBody* const cube = application.add_solid(std::move(made), 200);
  cube->setVelocity(vector(speed, 0, 0));
  application.add(make_box(0.6, 0.6, 0.6), at(0.2, 0, 0), 0.5, 1);
  const btVector3 start = read_state(application).momentum;
  const auto change = std::make_shared<double>(0);
  watch.after_step.push_back([=](const State& state, double) {
    *change = std::max(*change, static_cast<double>((state.momentum - start).length()));
  });
  watch.figures.push_back([=] {
    Figure figure{"change of momentum, % of what there is",
                  100 * *change / static_cast<double>(start.length())};
    figure.at_most = 0.1;  // rounding, and the end of Bullet's iterations
    return figure;
  });
  watch_energy(watch, application, 0.01 * 0.5 * 0.5 * speed * speed);
}

// Soft boxes slide on a ground. Each has a coefficient of its own.
void build_sliding(Application& application, Watch& watch, bool as_bullet) {
  application.add(make_box(80, 0.4, 40), at(30, -0.2, 0), 0, 1);
  constexpr double speed = 6, side = 1;
  int lane = 0;
  for (const double friction : {0.005, 0.01, 0.02, 0.03, 0.05}) {
    const btVector3 corner = vector(0, 0.03, 2 * lane++ - 4);
    btVector3 corners[8];
    for (int i = 0; i < 8; ++i)
      corners[i] = corner + vector(side * (i & 1), side * (i >> 1 & 1), side * (i >> 2));
    std::unique_ptr<btSoftBody> box(
        btSoftBodyHelpers::CreateFromConvexHull(application.info(), corners, 8));
    box->generateBendingConstraints(2);
    box->setTotalMass(1);
    box->m_cfg.kDF = scalar(friction);
    btSoftBody* const added = application.add(std::move(box));
    // Bullet's default. With more, its links pull what a contact has stopped in the same step.
    added->m_cfg.piterations = 1;
    added->setVelocity(vector(speed, 0, 0));
    const double start = static_cast<double>(middle_of(*added).x());
    char name[64];
    std::snprintf(name, sizeof name, "distance with kDF %g, m", friction);
    watch.figures.push_back([=, &application, name = std::string(name)] {
      Figure figure{name, static_cast<double>(middle_of(*added).x()) - start};
      // Coulomb's law, until it rests or the run ends. With a larger coefficient the box tumbles.
      const double slowing = friction * application.settings().gravity;
      const double time = std::min(speed / slowing, application.time());
      const double distance = speed * time - 0.5 * slowing * time * time;
      if (as_bullet) {
        figure.as_bullet = 0.1;
      } else if (friction < 0.5) {
        figure.at_least = 0.9 * distance;
        figure.at_most = 1.1 * distance;
      }
      return figure;
    });
  }
}

}  // namespace

std::vector<Behaviour> exchange_behaviours() {
  Behaviour collision;
  collision.name = "momentum";
  collision.description = "a soft cube and a box collide in free space";
  collision.in_rigid_world = false;
  collision.gravity = 0;
  collision.seconds = 1.5;
  collision.build = build_collision;
  Behaviour sliding;
  sliding.name = "sliding";
  sliding.description = "soft boxes of different friction slide on a ground";
  sliding.seconds = 3;
  sliding.build = [](Application& a, Watch& w) { build_sliding(a, w, true); };
  Behaviour coulomb = sliding;
  coulomb.name = "sliding-coulomb";
  coulomb.description += ", with LazyCCD's option coulomb_friction";
  coulomb.in_deformable_world = false;
  coulomb.coulomb_friction = true;
  coulomb.build = [](Application& a, Watch& w) { build_sliding(a, w, false); };
  return {collision, sliding, coulomb};
}

}  // namespace lazyccd::scenes::behaviour
