// The programs lazyccd_behaviour and lazyccd_behaviour_double: run the behaviour scenes with Bullet
// alone and with LazyCCD, and print what each is judged by.
//
//   lazyccd_behaviour [--only TEXT] [--csv FILE]
//   lazyccd_behaviour --curve [--only TEXT] [--csv FILE]
//
// The table has a row for each figure: its value with Bullet alone and with LazyCCD, its bound, and
// a mark if LazyCCD does not keep it. Pass-throughs are counted after each substep. --curve instead
// runs the scenes that start clean, and some of the library, with 1 to 32 substeps of a frame of
// 1/60 s: what a simulated second costs, and how many pass-throughs it has. Times are of one run.
// Bullet alone runs in a process of its own, because it may crash.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/child_process.h"
#include "bench/machine.h"
#include "scenes/behaviour/behaviour.h"
#include "scenes/run.h"

namespace lazyccd::scenes::behaviour {
namespace {

constexpr const char* precision = sizeof(btScalar) == sizeof(float) ? "float" : "double";

struct Request {
  std::string only, csv;
  bool curve = false;
};

const char* name_of(World world) { return world == World::rigid ? "rigid" : "deformable"; }
const char* name_of(Collisions collisions) {
  return collisions == Collisions::bullet ? "Bullet" : "LazyCCD";
}

std::string bound_of(const Figure& figure) {
  char text[96];
  if (figure.as_bullet) {
    std::snprintf(text, sizeof text, "as Bullet, %g %%", 100 * *figure.as_bullet);
  } else if (std::isfinite(figure.at_least) && std::isfinite(figure.at_most)) {
    std::snprintf(text, sizeof text, "%.3g to %.3g", figure.at_least, figure.at_most);
  } else if (std::isfinite(figure.at_least)) {
    std::snprintf(text, sizeof text, ">= %g", figure.at_least);
  } else if (std::isfinite(figure.at_most)) {
    std::snprintf(text, sizeof text, "<= %g", figure.at_most);
  } else {
    return "";
  }
  return text;
}

void write_table_heading(std::ostream& csv) {
  csv << "scene,world,precision,figure,bound,Bullet,LazyCCD,Bullet right,LazyCCD right,"
         "Bullet pass-throughs,LazyCCD pass-throughs,Bullet ms a second,LazyCCD ms a second,"
         "machine\n";
}

// A run with Bullet alone.
struct BulletRun {
  static constexpr std::size_t max_figures = 16;
  std::array<double, max_figures> values{};  // of the figures
  std::int64_t pass_throughs = 0;
  double ms_per_second = 0;
};

BulletRun run_bullet(const Behaviour& scene, World world) {
  const Report report = run(scene, {world, Collisions::bullet});
  BulletRun result;
  for (std::size_t i = 0; i < report.figures.size(); ++i)
    result.values.at(i) = report.figures[i].value;
  result.pass_throughs = report.pass_throughs;
  result.ms_per_second = report.ms_per_second;
  return result;
}

// A row of the table, before LazyCCD has run.
struct Comparison {
  const Behaviour* scene;
  World world;
  std::optional<BulletRun> bullet;  // nothing: it crashed
};

void add_rows(const Comparison& comparison, std::ostream& csv) {
  const Report ours = run(*comparison.scene, {comparison.world, Collisions::lazyccd});
  const std::string scene = comparison.scene->name;
  const char* const world = name_of(comparison.world);
  for (std::size_t i = 0; i < ours.figures.size(); ++i) {
    const Figure& figure = ours.figures[i];
    Figure alone = figure;
    std::string alone_value = "crashed", alone_passed = "crashed", alone_ms = "crashed";
    if (comparison.bullet) {
      const auto text = [](const char* format, auto value) {
        char buffer[32];
        std::snprintf(buffer, sizeof buffer, format, value);
        return std::string(buffer);
      };
      alone.value = comparison.bullet->values.at(i);
      alone_value = text("%.4g", alone.value);
      alone_passed = std::to_string(comparison.bullet->pass_throughs);
      alone_ms = text("%.3g", comparison.bullet->ms_per_second);
    }
    const bool alone_right = comparison.bullet && is_right(alone, alone),
               right = is_right(figure, alone);
    const std::string bound = bound_of(figure);
    std::printf("| %s | %s | %s | %s | %.4g | %s%s |", scene.c_str(), world, figure.name.c_str(),
                alone_value.c_str(), figure.value, bound.c_str(), right ? "" : " **not kept**");
    std::printf(" %s | %lld | %s | %.3g |\n", alone_passed.c_str(),
                static_cast<long long>(ours.pass_throughs), alone_ms.c_str(), ours.ms_per_second);
    csv << scene << ',' << world << ',' << precision << ",\"" << figure.name << "\",\"" << bound
        << "\"," << alone_value << ',' << figure.value << ',' << alone_right << ',' << right << ','
        << alone_passed << ',' << ours.pass_throughs << ',' << alone_ms << ',' << ours.ms_per_second
        << ',' << bench::machine() << std::endl;
  }
  std::fflush(stdout);
}

// Bullet's runs come first: a child process has no threads of earlier runs.
void print_table(const Request& request, std::ostream& csv) {
  std::vector<Comparison> comparisons;
  for (const Behaviour& scene : all_behaviours()) {
    if (scene.name.find(request.only) == std::string::npos) continue;
    for (const World world : {World::rigid, World::deformable})
      if (scene.runs_in(world))
        comparisons.push_back(
            {&scene, world, bench::run_in_child([&] { return run_bullet(scene, world); })});
  }
  write_table_heading(csv);
  std::printf(
      "| scene, %s | world | figure | Bullet alone | LazyCCD | bound | pass-throughs: Bullet | "
      "LazyCCD | ms a simulated second: Bullet | LazyCCD |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      precision);
  for (const Comparison& comparison : comparisons) add_rows(comparison, csv);
}

// A point of the chart: one run.
struct Point {
  bool completed = false;  // false: a position was not finite, or the process crashed
  double ms_per_second = 0;
  std::int64_t pass_throughs = 0;
  double edges_at_end = 0;
};

Point point_of(const Behaviour& scene, World world, Collisions collisions, int substeps) {
  Run how{world, collisions, substeps};
  how.seconds = 1.5;
  const Report report = run(scene, how);
  return {report.finite, report.ms_per_second, report.pass_throughs, report.edges_at_end};
}

// A scene of the library at its own speed, for one second at most.
Point point_of(const SceneInfo& info, World world, Collisions collisions, int substeps) {
  Parameters parameters;
  parameters.world = world;
  parameters.collisions = collisions;
  parameters.dt = frame_seconds / substeps;
  Scene scene = set_up(info, parameters);
  scene.steps = std::min(scene.steps, 60 * substeps);
  const RunReport report = scenes::run(scene);
  return {report.finite, report.mean.total * 60 * substeps,
          report.crossings_vf + report.crossings_ee,
          static_cast<double>(report.intersections.size())};
}

template <class Any>
void add_points(const std::string& name, World world, const Any& scene, std::ostream& csv) {
  for (const Collisions collisions : {Collisions::bullet, Collisions::lazyccd}) {
    const int most = collisions == Collisions::bullet ? 32 : 4;
    for (int substeps = 1; substeps <= most; substeps *= 2) {
      const Point point = bench::run_in_child([&] {
                            return point_of(scene, world, collisions, substeps);
                          }).value_or(Point());
      std::printf("| %s | %s | %s | %d | %.4g | %lld | %g |%s\n", name.c_str(), name_of(world),
                  name_of(collisions), substeps, point.ms_per_second,
                  static_cast<long long>(point.pass_throughs), point.edges_at_end,
                  point.completed ? "" : " positions lost |");
      std::fflush(stdout);
      csv << name << ',' << name_of(world) << ',' << precision << ',' << name_of(collisions) << ','
          << substeps << ',' << point.ms_per_second << ',' << point.pass_throughs << ','
          << point.edges_at_end << ',' << point.completed << ',' << bench::machine() << std::endl;
    }
  }
}

void print_curve(const Request& request, std::ostream& csv) {
  csv << "scene,world,precision,collisions,substeps,ms a second,pass-throughs,edges at the end,"
         "completed,machine\n";
  std::printf(
      "| scene, %s | world | collisions | substeps | ms a simulated second | pass-throughs | "
      "edges through faces at the end |\n|---|---|---|---|---|---|---|\n",
      precision);
  const auto chosen = [&](const std::string& name) {
    return name.find(request.only) != std::string::npos;
  };
  for (const Behaviour& scene : all_behaviours()) {
    if (!scene.on_curve || !chosen(scene.name)) continue;
    for (const World world : {World::rigid, World::deformable}) {
      if (scene.runs_in(world)) add_points(scene.name, world, scene, csv);
    }
  }
  for (const char* name : {"cloth-on-cloth", "cloth-on-mesh", "fold", "crossing-ropes"}) {
    const SceneInfo* const scene = find_scene(name);
    if (!scene || !chosen(name)) continue;
    for (const World world : {World::rigid, World::deformable})
      add_points(name, world, *scene, csv);
  }
}

}  // namespace
}  // namespace lazyccd::scenes::behaviour

int main(int argc, char** argv) {
  namespace behaviour = lazyccd::scenes::behaviour;
  CLI::App app("Behaviour scenes: Bullet alone against LazyCCD as a drop-in");
  behaviour::Request request;
  app.add_option("--only", request.only, "only scenes whose names contain this text");
  app.add_option("--csv", request.csv, "write the table to this file");
  app.add_flag("--curve", request.curve,
               "cost and pass-throughs over the number of substeps of a frame");
  CLI11_PARSE(app, argc, argv);
  std::ofstream csv;
  if (!request.csv.empty()) {
    csv.open(request.csv);
    if (!csv) {
      std::fprintf(stderr, "lazyccd_behaviour: cannot write %s\n", request.csv.c_str());
      return 1;
    }
  }
  (request.curve ? behaviour::print_curve : behaviour::print_table)(request, csv);
  return 0;
}
