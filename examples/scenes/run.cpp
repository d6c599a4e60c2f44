#include "scenes/run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "scenes/measures/crossings.h"

namespace lazyccd::scenes {
namespace {

StepTimes times(double total, const bullet::StepStats* stats) {
  const bullet::StepStats none;
  const bullet::StepStats& s = stats ? *stats : none;
  const double ours = s.ms_gather + s.ms_detect + s.ms_response + s.ms_write;
  return {total, total - ours, s.ms_gather, s.ms_detect, s.ms_response, s.ms_write};
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class Average>
StepTimes each_part(const std::vector<StepTimes>& steps, Average&& average) {
  StepTimes result;
  if (steps.empty()) return result;
  for (double StepTimes::*part : {&StepTimes::total, &StepTimes::bullet, &StepTimes::gather,
                                  &StepTimes::detect, &StepTimes::response, &StepTimes::write}) {
    std::vector<double> values;
    for (const StepTimes& step : steps) values.push_back(step.*part);
    result.*part = average(values);
  }
  return result;
}

}  // namespace

RunReport run(Scene& scene, const std::function<void(int step)>& after_step) {
  PhysicsWorld& world = *scene.world;
  CrossingCounter crossings(world);
  RunReport report;
  report.margin = world.options().margin;
  report.start = report.end = measure(world);
  report.highest_energy = report.start.energy();
  report.initial_intersections =
      find_intersections(read_surface(world), read_positions(world)).size();
  if (after_step) after_step(0);
  while (report.steps < scene.steps) {
    const auto begin = std::chrono::steady_clock::now();
    world.step();
    const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - begin;
    const bullet::StepStats* const stats = world.step_stats();
    report.times.push_back(times(wall.count(), stats));
    if (stats) report.lazyccd_steps.push_back(*stats);
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
  if (report.finite)
    report.intersections = find_intersections(read_surface(world), read_positions(world));
  if (scene.nodes_on_wrong_side) report.wrong_side = scene.nodes_on_wrong_side();
  report.mean = each_part(report.times, mean);
  report.median = each_part(report.times, median);
  if (const bullet::StepStats* stats = world.total_stats()) report.lazyccd = *stats;
  report.status = world.status();
  return report;
}

}  // namespace lazyccd::scenes
