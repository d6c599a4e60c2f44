#include "lazyccd/bullet/report.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

StepStats& StepStats::operator+=(const StepStats& s) {
  steps += s.steps;
  soft_bodies += s.soft_bodies;
  sleeping_bodies += s.sleeping_bodies;
  handled_pairs += s.handled_pairs;
  detections += s.detections;
  started_ahead += s.started_ahead;
  contacts_vf += s.contacts_vf;
  contacts_ee += s.contacts_ee;
  impact_zone_nodes += s.impact_zone_nodes;
  failsafe_holds += s.failsafe_holds;
  unresolved += s.unresolved;
  initial_contacts += s.initial_contacts;
  initial_intersections += s.initial_intersections;
  fallback_steps += s.fallback_steps;
  energy_gained += s.energy_gained;
  energy_lost += s.energy_lost;
  ms_gather += s.ms_gather;
  ms_detect += s.ms_detect;
  ms_response += s.ms_response;
  ms_write += s.ms_write;
  return *this;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
