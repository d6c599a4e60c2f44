// Collision flags decide: what Bullet does not ask for does not happen, and costs nothing.
#include <algorithm>

#include "scenes/behaviour/behaviour.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::scenes::behaviour {
namespace {

// Five ropes fall on five pinned ones, at right angles.
void build_ropes(Application& application, Watch& watch, bool collide) {
  constexpr int count = 5, nodes = 21;
  constexpr double length = 2;
  using Flag = btSoftBody::fCollision;
  std::vector<btSoftBody*> falling;
  for (int i = 0; i < 2 * count; ++i) {
    const bool pinned = i < count;
    const double aside = 0.3 * (i % count - 2) + 0.013;
    const btVector3 along = pinned ? vector(length / 2, 0, 0) : vector(0, 0, length / 2);
    const btVector3 middle = pinned ? vector(0, 0, aside) : vector(aside, 0.3, 0);
    auto rope = make_rope(application.info(), nodes, 0.05, middle - along, middle + along);
    if (pinned) {
      rope->setMass(0, 0);
      rope->setMass(nodes - 1, 0);
    }
    btSoftBody* const added = application.add(std::move(rope), 0.02, 50);
    added->m_cfg.collisions &= ~(Flag::VF_SS | Flag::VF_DD);
    if (collide) added->m_cfg.collisions |= application.is_rigid() ? Flag::VF_SS : Flag::VF_DD;
    if (!pinned) falling.push_back(added);
  }
  watch.figures.push_back([&application] {
    const bullet::StepStats* const stats = application.total_stats();
    return Figure{"contacts of LazyCCD",
                  stats ? static_cast<double>(stats->contacts_vf + stats->contacts_ee) : 0};
  });
  watch.figures.push_back([=] {
    double lowest = 0;
    for (const btSoftBody* rope : falling)
      lowest = std::min(lowest, static_cast<double>(middle_of(*rope).y()));
    // Ropes that pass fall freely: g t^2 / 2.
    Figure figure{"lowest falling rope, m", lowest};
    if (collide) figure.at_least = -1.5;
    if (!collide) figure.as_bullet = 0.01;
    return figure;
  });
}

}  // namespace

std::vector<Behaviour> flag_behaviours() {
  Behaviour without;
  without.name = "ropes-without-flag";
  without.description = "ropes fall across each other without VF_SS or VF_DD: nothing is to happen";
  without.seconds = 1;
  without.build = [](Application& a, Watch& w) { build_ropes(a, w, false); };
  Behaviour with = without;
  with.name = "ropes-with-flag";
  with.description = "ropes with VF_SS or VF_DD fall across each other: they are to collide";
  with.build = [](Application& a, Watch& w) { build_ropes(a, w, true); };
  return {without, with};
}

}  // namespace lazyccd::scenes::behaviour
