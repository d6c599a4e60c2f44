#include "scenes/behaviour/behaviour.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace lazyccd::scenes::behaviour {

const std::vector<Behaviour>& all_behaviours() {
  static const std::vector<Behaviour> scenes = [] {
    std::vector<Behaviour> all;
    for (const auto& part :
         {teleport_behaviours(), grip_behaviours(), start_behaviours(), multibody_behaviours(),
          exchange_behaviours(), flag_behaviours(), rest_behaviours(), user_behaviours()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return scenes;
}

const Behaviour& find_behaviour(const std::string& name) {
  for (const Behaviour& scene : all_behaviours()) {
    if (scene.name == name) return scene;
  }
  throw std::invalid_argument("no behaviour scene has the name " + name);
}

Report run(const Behaviour& behaviour, const Run& how) {
  using Clock = std::chrono::steady_clock;
  Settings settings;
  settings.world = how.world;
  settings.collisions = how.collisions;
  const bool rigid = how.world == World::rigid;
  const int own = rigid ? behaviour.rigid_substeps : behaviour.deformable_substeps;
  settings.substeps = how.substeps > 0 ? how.substeps : own;
  settings.gravity = behaviour.gravity;
  settings.threaded_dispatcher = behaviour.threaded_dispatcher;
  settings.lazyccd = how.lazyccd;
  settings.lazyccd.coulomb_friction |= behaviour.coulomb_friction;
  Application application(settings);
  Watch watch;
  behaviour.build(application, watch);

  Report report;
  Observer observer(application);
  report.edges_at_start = sticking_edges(application);
  Clock::duration counting{0};
  const int frames =
      static_cast<int>(std::lround(std::min(behaviour.seconds, how.seconds) / frame_seconds));
  double seconds = 0;
  const auto begin = Clock::now();
  const auto after_step = [&] {
    const auto start = Clock::now();
    seconds += frame_seconds / settings.substeps;
    const bool jump = application.take_jump();
    observer.step(jump);
    const State state = read_state(application);
    report.finite &= state.finite;
    for (const auto& function : watch.after_step) function(state, seconds);
    counting += Clock::now() - start;
  };
  for (int i = 0; i < frames && report.finite; ++i) application.frame(after_step);
  const std::chrono::duration<double, std::milli> wall = Clock::now() - begin - counting;
  report.ms_per_second = wall.count() / std::max(frame_seconds, application.time());

  for (const auto& figure : watch.figures) report.figures.push_back(figure());
  report.edges_at_end = sticking_edges(application);
  report.pass_throughs = observer.pass_throughs();
  if (const bullet::StepStats* stats = application.total_stats()) report.lazyccd = *stats;
  report.status = application.status();
  return report;
}

bool needs_bullet(const Figure& figure) { return figure.as_bullet.has_value(); }

bool is_right(const Figure& figure, const Figure& alone) {
  if (!(figure.value >= figure.at_least && figure.value <= figure.at_most)) return false;
  return !figure.as_bullet ||
         std::abs(figure.value - alone.value) <= *figure.as_bullet * std::abs(alone.value);
}

namespace {

std::shared_ptr<double> track_fastest_node(Watch& watch, double from) {
  const auto fastest = std::make_shared<double>(0);
  watch.after_step.push_back([=](const State& state, double time) {
    if (time >= from) *fastest = std::max(*fastest, state.fastest_node);
    if (!state.finite) *fastest = std::numeric_limits<double>::infinity();
  });
  return fastest;
}

constexpr const char* fastest_node_name = "fastest node, m/s";

}  // namespace

void watch_fastest_node(Watch& watch, double at_most, double from) {
  const auto fastest = track_fastest_node(watch, from);
  watch.figures.push_back([=] {
    Figure figure{fastest_node_name, *fastest};
    figure.at_most = at_most;
    return figure;
  });
}

void watch_fastest_node_as_bullet(Watch& watch, double difference) {
  const auto fastest = track_fastest_node(watch, 0);
  watch.figures.push_back([=] {
    Figure figure{fastest_node_name, *fastest};
    figure.as_bullet = difference;
    return figure;
  });
}

void watch_energy(Watch& watch, Application& application, double at_most) {
  const double start = read_state(application).energy();
  const auto rise = std::make_shared<double>(0);
  watch.after_step.push_back([=](const State& state, double) {
    *rise = state.finite ? std::max(*rise, state.energy() - start)
                         : std::numeric_limits<double>::infinity();
  });
  watch.figures.push_back([=] {
    Figure figure{"energy gained, J", *rise};
    figure.at_most = at_most;
    return figure;
  });
}

void watch_sticking_edges(Watch& watch, Application& application, int at_most) {
  watch.figures.push_back([&application, at_most] {
    Figure figure{"edges through faces at the end", sticking_edges(application)};
    figure.at_most = at_most;
    return figure;
  });
}

void watch_sticking_edges_at(Watch& watch, Application& application, double seconds) {
  const auto count = std::make_shared<double>(0);
  application.call_at(seconds, [&application, count] { *count = sticking_edges(application); });
  const std::string name =
      seconds == 0 ? "edges through faces at the start" : "edges through faces after 1 s";
  watch.figures.push_back([=] { return Figure{name, *count}; });
}

void watch_rest(Watch& watch, double at_most) {
  const auto rest = std::make_shared<double>(0);
  watch.after_step.push_back([=](const State& state, double time) {
    if (!(state.fastest_node < 0.1)) *rest = time;
  });
  watch.figures.push_back([=] {
    Figure figure{"time until all nodes stay below 0.1 m/s, s", *rest};
    figure.at_most = at_most;
    return figure;
  });
}

}  // namespace lazyccd::scenes::behaviour
