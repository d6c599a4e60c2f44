#include "scenes/run.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "scenes/crossings.h"

namespace lazyccd::scenes {

RunReport run(Scene& scene, const std::function<void(int step)>& after_step) {
  PhysicsWorld& world = *scene.world;
  CrossingCounter crossings(world);
  RunReport report;
  report.margin = world.options().margin;
  report.start = report.end = measure(world);
  report.highest_energy = report.start.energy();
  report.piercings_at_start = find_piercings(read_surface(world), read_positions(world)).size();
  if (after_step) after_step(0);
  double seconds = 0;
  while (report.steps < scene.steps) {
    const auto begin = std::chrono::steady_clock::now();
    world.step();
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    ++report.steps;
    const std::vector<btScalar> positions = read_positions(world);
    report.finite = std::all_of(positions.begin(), positions.end(),
                                [](btScalar x) { return std::isfinite(x); });
    if (!report.finite) break;
    crossings.step(world);
    for (const auto& body : world.bodies()) {
      report.listed_contacts += body->m_scontacts.size() + body->m_faceNodeContacts.size();
    }
    report.end = measure(world);
    report.kinetic_energy.push_back(report.end.kinetic_energy);
    report.highest_energy = std::max(report.highest_energy, report.end.energy());
    if (after_step) after_step(report.steps);
  }
  report.crossings_vf = crossings.vertex_face();
  report.crossings_ee = crossings.edge_edge();
  if (report.finite) report.piercings = find_piercings(read_surface(world), read_positions(world));
  if (scene.nodes_on_wrong_side) report.wrong_side = scene.nodes_on_wrong_side();
  report.ms_step = report.steps ? 1000 * seconds / report.steps : 0;
  if (const bullet::StepStats* stats = world.total_stats()) report.lazyccd = *stats;
  report.status = world.status();
  return report;
}

}  // namespace lazyccd::scenes
