#include "response/support_loads.h"

#include <algorithm>
#include <map>

#include "contact/rigid_terms.h"
#include "settings.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

bool any_is_held(const Motion& motion) {
  return std::any_of(motion.rigid().begin(), motion.rigid().end(),
                     [](const RigidMotion& body) { return body.supported_mobility.has_value(); });
}

// Sum of the impulses on each body that is held, by its index in Motion::rigid.
std::map<int, Vector6d> impulses_on_held(const std::vector<const ContactRow*>& rows,
                                         const Motion& motion) {
  std::map<int, Vector6d> sums;
  if (!any_is_held(motion)) return sums;
  for (const ContactRow* const row : rows) {
    if (!row->has_impulse()) continue;
    const Vector3d impulse = row->impulse();
    for (const RigidTerm& term : RigidTerms(row->contact, row->weights, motion)) {
      if (!motion.rigid()[term.body].supported_mobility) continue;
      Vector6d& sum = sums.insert({term.body, Vector6d::Zero()}).first->second;
      sum += term.wrench_of(impulse);
    }
  }
  return sums;
}

// Whether the contact has a side of soft vertices that impulses do not move.
bool has_prescribed_nodes(const Contact& contact, const Motion& motion) {
  const std::array<double, 4> weights = contact.weights();
  bool any = false;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    if (weights[i] == 0 || !motion.is_soft(v)) continue;
    if (motion.is_movable(v)) return false;
    any = true;
  }
  return any;
}

}  // namespace

void hold_at_supports(const NearContacts& near, Motion& motion) {
  const auto is_supported = [](const RigidMotion& body) { return !body.supports.empty(); };
  if (std::none_of(motion.rigid().begin(), motion.rigid().end(), is_supported)) return;
  ScratchVector<char> is_near(motion.rigid().size(), 0), is_prescribed(motion.rigid().size(), 0);
  for (std::size_t i = 0; i < near.contacts.size(); ++i) {
    if (!near.estimates[i].can_act) continue;
    const Contact& contact = near.contacts[i];
    for (const std::int32_t body : {contact.body_a, contact.body_b}) {
      const int rigid = motion.rigid_of_body()[body];
      if (rigid < 0 || !is_supported(motion.rigid()[rigid])) continue;
      is_near[rigid] = 1;
      if (has_prescribed_nodes(contact, motion)) is_prescribed[rigid] = 1;
    }
  }
  for (std::size_t i = 0; i < motion.rigid().size(); ++i)
    if (is_near[i] != 0 && is_prescribed[i] == 0)
      motion.solution_of(motion.rigid()[i]).supported_mobility =
          mobility_at_supports(motion.rigid()[i]);
}

ScratchVector<int> leave_supports(const std::vector<const ContactRow*>& rows, Motion& motion) {
  ScratchVector<int> left;
  for (const auto& [rigid, impulse] : impulses_on_held(rows, motion)) {
    const RigidMotion& body = motion.rigid()[rigid];
    if (leave_supports(body, impulse, motion.solution_of(body))) left.push_back(rigid);
  }
  return left;
}

void set_load_velocities(const std::vector<const ContactRow*>& rows, Motion& motion) {
  for (const auto& [rigid, impulse] : impulses_on_held(rows, motion)) {
    const RigidMotion& body = motion.rigid()[rigid];
    const Vector6d load = (free_mobility(body) - *body.supported_mobility) * impulse / motion.dt();
    double reach = 0;
    for (const Support& support : body.supports) reach = std::max(reach, support.arm.norm());
    const double speed = std::max(load.head<3>().norm(), reach * load.tail<3>().norm());
    const double passed_on =
        speed > settings::supports::max_load_speed ? settings::supports::max_load_speed / speed : 1;
    RigidSolution& solution = motion.solution_of(body);
    solution.load_velocity = passed_on * load.head<3>();
    solution.load_angular_velocity = passed_on * load.tail<3>();
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
