// Behaviour scenes: small applications, each with the figures that show whether LazyCCD behaves as
// a drop-in. They run with Bullet alone and with LazyCCD.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "scenes/behaviour/application.h"
#include "scenes/behaviour/observer.h"

namespace lazyccd::scenes::behaviour {

/// What a scene tracks while it runs, and its figures at the end.
struct Watch {
  /// Called after each substep with the state then.
  std::vector<std::function<void(const State&, double time)>> after_step;
  /// Called at the end.
  std::vector<std::function<Figure()>> figures;
};

/// A behaviour scene, before it is set up.
struct Behaviour {
  std::string name;
  std::string description;
  bool in_rigid_world = true, in_deformable_world = true;
  double seconds = 2;
  /// Substeps of a frame that an application would use.
  int rigid_substeps = 1, deformable_substeps = 4;
  double gravity = 9.8;  // m/s^2
  bool threaded_dispatcher = false;
  bool coulomb_friction = false;  // LazyCCD's option
  /// True: part of the chart of cost against pass-throughs. Others start intersecting or are about
  /// something else.
  bool on_curve = false;
  std::function<void(Application&, Watch&)> build;

  bool runs_in(World world) const {
    return world == World::rigid ? in_rigid_world : in_deformable_world;
  }
};

/// A scene with these properties, and the defaults for the others.
inline Behaviour make_behaviour(const char* name, const char* description, double seconds,
                                std::function<void(Application&, Watch&)> build) {
  Behaviour scene;
  scene.name = name;
  scene.description = description;
  scene.seconds = seconds;
  scene.build = std::move(build);
  return scene;
}

const std::vector<Behaviour>& all_behaviours();
/// Throws std::invalid_argument if no scene has this name.
const Behaviour& find_behaviour(const std::string& name);

struct Report {
  std::vector<Figure> figures;
  std::int64_t pass_throughs = 0;  // after each substep, pairs that passed through each other
  double edges_at_start = 0, edges_at_end = 0;  // edges that pass through faces
  double ms_per_second = 0;  // wall time of a simulated second, without the counters, ms
  bool finite = true;        // false: the run stopped
  bullet::StepStats lazyccd;
  std::string status;
};

struct Run {
  World world = World::rigid;
  Collisions collisions = Collisions::lazyccd;
  int substeps = 0;  // of a frame; 0: the scene's own
  bullet::SolverOptions lazyccd = {};
  /// Simulated at most, s. Figures of scenes that end early mean little.
  double seconds = std::numeric_limits<double>::infinity();
};
Report run(const Behaviour& behaviour, const Run& how);

/// Returns true if the figure keeps its bounds. `alone`: the same figure with Bullet alone.
bool is_right(const Figure& figure, const Figure& alone);
bool needs_bullet(const Figure& figure);

// Figures that several scenes have. Each watches the whole run, or from `from` seconds on.

/// Largest speed of a node, m/s.
void watch_fastest_node(Watch& watch, double at_most, double from = 0);
/// The same, compared with Bullet alone: the largest relative difference.
void watch_fastest_node_as_bullet(Watch& watch, double difference);
/// Largest rise of kinetic plus potential energy over its start, J.
void watch_energy(Watch& watch, Application& application, double at_most);
/// Edges that pass through faces at the end.
void watch_sticking_edges(Watch& watch, Application& application, int at_most = 0);
/// The same at a moment; no bound.
void watch_sticking_edges_at(Watch& watch, Application& application, double seconds);
/// Time in seconds after which no node is faster than 0.1 m/s.
void watch_rest(Watch& watch, double at_most);

// Each function returns the scenes of one file.
std::vector<Behaviour> teleport_behaviours();
std::vector<Behaviour> grip_behaviours();
std::vector<Behaviour> start_behaviours();
std::vector<Behaviour> multibody_behaviours();
std::vector<Behaviour> exchange_behaviours();
std::vector<Behaviour> flag_behaviours();
std::vector<Behaviour> rest_behaviours();
std::vector<Behaviour> user_behaviours();

}  // namespace lazyccd::scenes::behaviour
