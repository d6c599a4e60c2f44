// The behaviour scenes with LazyCCD: each keeps the figures that physics or Bullet gives.
#include <algorithm>
#include <string>

#include "scenes/behaviour/behaviour.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using scenes::Collisions;
using scenes::World;
using scenes::behaviour::Behaviour;
using scenes::behaviour::Figure;
using scenes::behaviour::Report;

namespace {

constexpr World worlds[] = {World::rigid, World::deformable};

Report run(const Behaviour& scene, World world, Collisions collisions = Collisions::lazyccd) {
  return scenes::behaviour::run(scene, {world, collisions});
}

enum class Passing { never, not_counted };

// Runs a scene in its worlds and checks all its figures.
void check(const std::string& name, Passing passing = Passing::never) {
  const Behaviour& scene = scenes::behaviour::find_behaviour(name);
  for (const World world : worlds) {
    if (!scene.runs_in(world)) continue;
    const Report report = run(scene, world);
    Report alone;
    if (std::any_of(report.figures.begin(), report.figures.end(), scenes::behaviour::needs_bullet))
      alone = run(scene, world, Collisions::bullet);
    for (std::size_t i = 0; i < report.figures.size(); ++i) {
      const Figure& figure = report.figures[i];
      const Figure of_bullet = alone.figures.empty() ? figure : alone.figures[i];
      CAPTURE(name, world == World::rigid, figure.name, figure.value, figure.at_least,
              figure.at_most, of_bullet.value);
      CHECK(scenes::behaviour::is_right(figure, of_bullet));
    }
    CAPTURE(name, world == World::rigid, report.status);
    CHECK(report.finite);
    CHECK(report.lazyccd.fallback_steps == 0);
    if (passing == Passing::never) CHECK(report.pass_throughs == 0);
    if (test::is_sanitized) return;  // one world is enough for the sanitizers, which are slow
  }
}

double figure_of(const Report& report, const std::string& name) {
  for (const Figure& figure : report.figures) {
    if (figure.name == name) return figure.value;
  }
  FAIL("no figure has the name " << name);
  return 0;
}

}  // namespace

TEST_CASE("a body that the application puts elsewhere sweeps nothing on its way") {
  check(GENERATE("teleport-dynamic-between-steps", "teleport-dynamic-before-tick",
                 "teleport-dynamic-after-tick", "teleport-dynamic-in-solver",
                 "teleport-kinematic-between-steps", "teleport-kinematic-before-tick",
                 "teleport-static-between-steps", "teleport-static-before-tick"));
}

TEST_CASE("a gripper that a callback drives lifts a soft cube and throws nothing") {
  check("grip");
}

TEST_CASE("a box that starts through a cloth comes out") {
  check("start-box-through-cloth", Passing::not_counted);
}

TEST_CASE("a cloth that starts through a box comes out") {
  check("start-cloth-through-box", Passing::not_counted);
}

TEST_CASE("a ball that starts in a plane comes out") {
  check("start-ball-in-plane", Passing::not_counted);
}

TEST_CASE("two balls that start in each other come apart") {
  check("start-ball-in-ball", Passing::not_counted);
}

TEST_CASE("an open strip that starts through itself gets no further crossings") {
  check("start-held-in-itself", Passing::not_counted);
}

TEST_CASE("a chain of links that falls on a cloth is not thrown off") { check("chain-on-cloth"); }

TEST_CASE("two fingers with motors lift a cloth by friction") { check("gripper"); }

TEST_CASE("a cloth rests on a robot with fixed joints as on static bodies") {
  check("fixed-robot");
  for (const World world : worlds) {
    const char* const height = "highest node at the end, m";
    const Report links = run(scenes::behaviour::find_behaviour("fixed-robot"), world);
    const Report bodies = run(scenes::behaviour::find_behaviour("fixed-bodies"), world);
    CHECK(figure_of(links, height) == Approx(figure_of(bodies, height)).margin(0.01));
  }
}

TEST_CASE("a finger with a motor pushes a soft ball and stays out of it") { check("hand-in-ball"); }

TEST_CASE("an elastic cube and a box keep their momentum when they collide") { check("momentum"); }

TEST_CASE("soft boxes slide as far as with Bullet alone") { check("sliding"); }

TEST_CASE("soft boxes slide as far as Coulomb's law says if the application asks for it") {
  check("sliding-coulomb");
}

TEST_CASE("bodies without a flag for each other do not collide, and the status says so") {
  check("ropes-without-flag", Passing::not_counted);
  for (const World world : worlds) {
    const Report report = run(scenes::behaviour::find_behaviour("ropes-without-flag"), world);
    CHECK(figure_of(report, "contacts of LazyCCD") == 0);
    CHECK(report.status.find("VF_SS") != std::string::npos);
  }
}

TEST_CASE("ropes that have the flag catch each other") { check("ropes-with-flag"); }

TEST_CASE("a soft ball that is dropped comes to rest") { check("rest-ball"); }

TEST_CASE("a soft ring that is dropped comes to rest") { check("rest-torus"); }

TEST_CASE("sticks that a heavy ball hits are not thrown") { check("sticks"); }

TEST_CASE("soft bodies collide under a dispatcher with threads") { check("threaded-dispatcher"); }

TEST_CASE("a cloth rests on a GImpact mesh") { check("gimpact"); }

TEST_CASE("a cloth whose carrier hits a wall stays in one piece") { check("anchored-cloth"); }

TEST_CASE("a soft ball carries a weight") { check("pressed-ball"); }

TEST_CASE("the contacts of a resting cloth tell its weight") { check("contact-forces"); }

TEST_CASE("contacts of a cloth with itself do not turn the body that carries one of its nodes") {
  check("carrier", Passing::not_counted);
}

TEST_CASE("the figures find what goes wrong with Bullet alone") {
  const auto wrong = [](const char* name, World world) {
    const Report report = run(scenes::behaviour::find_behaviour(name), world, Collisions::bullet);
    return std::any_of(report.figures.begin(), report.figures.end(),
                       [](const Figure& figure) { return !is_right(figure, figure); });
  };
  CHECK(wrong("momentum", World::deformable));
  CHECK(wrong("fixed-robot", World::rigid));
  CHECK(wrong("hand-in-ball", World::rigid));
}
