#include "lazyccd/bullet/report.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

StepStats& StepStats::operator+=(const StepStats& s) {
  steps += s.steps;
  queued_pairs += s.queued_pairs;
  detections += s.detections;
  foreseen += s.foreseen;
  contacts_vf += s.contacts_vf;
  contacts_ee += s.contacts_ee;
  zone_nodes += s.zone_nodes;
  last_resorts += s.last_resorts;
  unresolved += s.unresolved;
  touching += s.touching;
  pierced_at_start += s.pierced_at_start;
  missed_steps += s.missed_steps;
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
