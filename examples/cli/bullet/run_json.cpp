#include "cli/bullet/run_json.h"

namespace lazyccd::program {
namespace {

nlohmann::ordered_json times_json(const scenes::StepTimes& ms) {
  return {{"total", ms.total},   {"bullet", ms.bullet},     {"gather", ms.gather},
          {"detect", ms.detect}, {"response", ms.response}, {"write", ms.write}};
}

// Times and counts of each step, as lists by name.
nlohmann::ordered_json steps_of(const scenes::RunReport& report) {
  nlohmann::ordered_json json;
  for (const scenes::StepTimes& ms : report.times) {
    json["ms_total"].push_back(ms.total);
    json["ms_bullet"].push_back(ms.bullet);
  }
  bullet::StepStats::for_each_member([&](const char* name, auto member) {
    for (const bullet::StepStats& step : report.lazyccd_steps) json[name].push_back(step.*member);
  });
  return json;
}

}  // namespace

nlohmann::ordered_json to_json(const scenes::RunReport& report) {
  const bullet::StepStats& stats = report.lazyccd;
  nlohmann::ordered_json json;
  json["steps"] = report.steps;
  json["finite"] = report.finite;
  json["margin_m"] = report.margin;
  json["pass_throughs"] = {{"vertex_face", report.crossings_vf},
                           {"edge_edge", report.crossings_ee}};
  json["initial_intersections"] = report.initial_intersections;
  json["intersections"] = report.intersections.size();
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (const scenes::Intersection& intersection : report.intersections)
    points.push_back(intersection.point);
  json["intersection_points"] = points;
  if (report.wrong_side) {
    json["nodes_on_wrong_side"] = *report.wrong_side;
  } else {
    json["nodes_on_wrong_side"] = nullptr;
  }
  json["contacts"] = {{"vertex_face", stats.contacts_vf}, {"edge_edge", stats.contacts_ee}};
  json["contacts_in_bullets_lists"] = report.listed_contacts;
  json["detections"] = stats.detections;
  json["started_ahead"] = stats.started_ahead;
  json["rechecks"] = stats.rechecks;
  json["impact_zone_nodes"] = stats.impact_zone_nodes;
  json["failsafe_holds"] = stats.failsafe_holds;
  json["unresolved"] = stats.unresolved;
  json["touching_at_start"] = stats.initial_contacts;
  json["fallback_steps"] = stats.fallback_steps;
  json["momentum_kg_m_s"] = {{"start", report.start.momentum},
                             {"end", report.end.momentum},
                             {"scale", report.start.impulse_scale}};
  json["angular_momentum_kg_m2_s"] = {{"start", report.start.angular_momentum},
                                      {"end", report.end.angular_momentum}};
  json["energy_J"] = {{"start_kinetic", report.start.kinetic_energy},
                      {"start_potential", report.start.potential_energy},
                      {"highest", report.highest_energy},
                      {"end_kinetic", report.end.kinetic_energy},
                      {"end_potential", report.end.potential_energy}};
  json["response_energy_J"] = {{"gained", stats.energy_gained}, {"lost", stats.energy_lost}};
  json["end_speed_m_s"] = {{"rms", report.end.rms_speed}, {"largest", report.end.largest_speed}};
  json["ms_per_step"] = times_json(report.mean);
  json["median_ms_per_step"] = times_json(report.median);
  json["kinetic_energy_J"] = report.kinetic_energy;
  json["each_step"] = steps_of(report);
  json["status"] = report.status;
  return json;
}

}  // namespace lazyccd::program
