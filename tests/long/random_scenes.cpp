// Runs hundreds of random scenes and prints what went wrong in each.
//
//   lazyccd_random_scenes_long --from 1 --count 1000 --world both
//
// Exit code 1 if a line has a word in capitals. It means one of these:
// - something passed through or intersects, and no kinematic body pressed it;
// - a position is not finite, and Bullet alone does not explode;
// - contacts are unresolved, or energy was gained, although nothing is driven.
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "random/random_options.h"
#include "random/random_scene.h"

using namespace lazyccd;

namespace {

// Runs the scene with Bullet alone in a child process. True also if it crashes or takes over 30 s.
bool explodes_with_bullet_alone(std::uint32_t number, scenes::World w) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    constexpr unsigned timeout = 30;  // seconds
    alarm(timeout);
    const test::SceneReport alone = test::run_random_scene(number, w, scenes::Collisions::bullet);
    _exit(alone.finite && alone.fastest < 1000 ? EXIT_SUCCESS : EXIT_FAILURE);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status != 0;
}

bool show(std::uint32_t number, scenes::World w, const test::SceneReport& r, bool all) {
  const bullet::StepStats& s = r.stats;
  std::string wrong;
  const bool exploded = !r.finite;  // Bullet's forces are unstable here
  if (r.crossings && !exploded) wrong += " CROSSED@" + std::to_string(r.first_crossing);
  if (r.intersections && !exploded) wrong += " INTERSECTS";
  if (r.overlaps && !exploded) wrong += s.failsafe_holds + s.unresolved ? " overlapped" : " PASSED";
  if (exploded)
    wrong += explodes_with_bullet_alone(number, w) ? " exploded-as-bullet" : " EXPLODED";
  if (s.unresolved) wrong += r.driven ? " crushed" : " UNRESOLVED";
  if (s.fallback_steps) wrong += " FALLBACK";
  if (s.initial_intersections) wrong += s.unresolved || r.driven ? " start" : " START";
  if (!r.driven && s.energy_gained > 1e-4 * (s.energy_lost + r.kinetic_at_start) + 1e-9)
    wrong += " ENERGY";
  if (r.left_out) wrong += " left-out";
  if (r.slowest_step > 2) wrong += " slow";
  if (s.failsafe_holds) wrong += " held";
  if (r.fastest > 20 * r.fastest_at_start + 100) wrong += " fast";
  if (!wrong.empty() || all) {
    std::printf(
        "%u:%s | cross %lld intersect %lld overlap %lld unresolved %lld held %lld zones %lld "
        "gained %.3g lost %.3g "
        "ke0 %.3g v0 %.3g v %.3g slowest %.2f s, %lld det, %d vertices %d steps |%s\n",
        number, wrong.c_str(), (long long)r.crossings, (long long)r.intersections,
        (long long)r.overlaps, (long long)s.unresolved, (long long)s.failsafe_holds,
        (long long)s.impact_zone_nodes, s.energy_gained, s.energy_lost, r.kinetic_at_start,
        r.fastest_at_start, r.fastest, r.slowest_step, (long long)s.detections, r.vertices, r.steps,
        r.what.c_str());
    if (all) std::printf("   %s", r.status.c_str());
    std::fflush(stdout);
  }
  return wrong.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") != std::string::npos;
}

void follow(const test::SceneStep& step) {
  const bullet::StepStats& s = step.stats;
  if (step.number == 0) std::printf("%s\n", step.what.c_str());
  if (step.crossings + s.unresolved + s.failsafe_holds + s.initial_intersections == 0 &&
      s.energy_gained == 0 && step.dt < 0.3)
    return;
  std::printf(
      "step %d: %.2f s, detections %lld, contacts %lld, zones %lld, held %lld, unresolved %lld, "
      "intersections at start %lld, gained %g J\n",
      step.number, step.dt, (long long)s.detections, (long long)(s.contacts_vf + s.contacts_ee),
      (long long)s.impact_zone_nodes, (long long)s.failsafe_holds, (long long)s.unresolved,
      (long long)s.initial_intersections, s.energy_gained);
  if (step.crossings == 0) return;
  for (const Contact& c : step.penetration_check.crossings()) {
    std::printf("  %s of bodies %d and %d at %.10f, inverse masses",
                c.kind == ContactKind::vertex_face ? "vertex-face" : "edge-edge", c.body_a,
                c.body_b, c.toi);
    for (const std::int32_t v : c.vertices)
      std::printf(" %g", static_cast<double>(step.penetration_check.surface().inverse_mass[v]));
    std::printf("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Random scenes in Bullet with LazyCCD");
  std::uint32_t from = 1, count = 100;
  std::string world = "both";
  bool all = false, bullet_alone = false, each_step = false, pushed = false;
  app.add_option("--from", from);
  app.add_option("--count", count);
  app.add_option("--world", world);
  app.add_flag("--all", all);
  app.add_flag("--bullet", bullet_alone);
  app.add_flag("--follow", each_step);
  app.add_flag("--pushed", pushed, "options at extreme values");
  CLI11_PARSE(app, argc, argv);
  std::function<void(const test::SceneStep&)> watch;
  if (each_step) watch = follow;
  bool bad = false;
  for (std::uint32_t number = from; number < from + count; ++number) {
    for (const scenes::World w : {scenes::World::rigid, scenes::World::deformable}) {
      if (world == "rigid" && w != scenes::World::rigid) continue;
      if (world == "deformable" && w != scenes::World::deformable) continue;
      const test::SceneReport report = test::run_random_scene(
          number, w, bullet_alone ? scenes::Collisions::bullet : scenes::Collisions::lazyccd,
          pushed ? test::random_options(number) : test::strict_options(), watch);
      bad = show(number, w, report, all) || bad;
    }
  }
  return bad;
}
