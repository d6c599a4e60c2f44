#include "contact/node_pushes.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// A soft body's side of a contact.
struct Side {
  const ContactRow* row;
  std::int32_t body, other;
  int first, last;  // of the four vertices
};

// The soft sides of a contact.
template <class Visit>
void for_each_soft_side(const ContactRow& row, const Motion& motion, const Visit& visit) {
  const Contact& contact = row.contact;
  const int first_of_b = first_vertex_of_b(contact.kind);
  for (const Side& side : {Side{&row, contact.body_a, contact.body_b, 0, first_of_b},
                           Side{&row, contact.body_b, contact.body_a, first_of_b, 4}})
    if (motion.rigid_of_body()[side.body] < 0) visit(side);
}

// Whether the other side is a weight.
bool has_weight(const Side& side, const Motion& motion) {
  const int rigid = motion.rigid_of_body()[side.other];
  if (rigid < 0 || !motion.rigid()[rigid].is_movable() || motion.rigid()[rigid].supported_mobility)
    return false;
  double mobility = 0;  // of the nodes, 1/kg
  for (int k = side.first; k < side.last; ++k) {
    const double weight = side.row->weights[k];
    mobility += weight * weight * motion.inverse_mass_of(side.row->contact.vertices[k]);
  }
  return mobility * side.row->normal_mass >= settings::links::min_part_of_nodes;
}

// How far the other side approaches in the step without impulses, or would approach by gravity if
// that is less, beyond the least that counts as pressing, metres.
double pressing_approach(const Side& side, const Motion& motion) {
  const btRigidBody* const body = btRigidBody::upcast(motion.rigid_of(side.other).object);
  if (!body) return 0;
  const Vector3d fall = motion.dt() * motion.dt() * to_double(body->getGravity());
  Vector3d moved = Vector3d::Zero(), fallen = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    if (k >= side.first && k < side.last) continue;
    const std::int32_t v = side.row->contact.vertices[k];
    moved += side.row->weights[k] * (motion.predicted[v] - motion.start_of(v));
    fallen += side.row->weights[k] * fall;
  }
  return -std::max(side.row->normal.dot(moved), side.row->normal.dot(fallen)) -
         settings::links::min_part_of_gravity * fall.norm();
}

// How far the contact moves a node of the side in the step, metres.
double largest_push(const Side& side, const Motion& motion) {
  double largest = 0;
  for (int k = side.first; k < side.last; ++k) {
    const std::int32_t v = side.row->contact.vertices[k];
    if (motion.is_free(v))
      largest = std::max(largest, std::abs(side.row->weights[k]) * motion.inverse_mass()[v] *
                                      side.row->normal_impulse);
  }
  return largest;
}

// By soft vertex: how far contacts move it in the step, metres.
ScratchVector<Vector3d> find_displacements(const std::vector<const ContactRow*>& rows,
                                           const Motion& motion) {
  ScratchVector<Vector3d> displacements(motion.inverse_mass().size(), Vector3d::Zero());
  for (const ContactRow* const row : rows) {
    const Vector3d impulse = row->impulse();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = row->contact.vertices[k];
      if (motion.is_free(v))
        displacements[v] += row->weights[k] * motion.inverse_mass()[v] * impulse;
    }
  }
  return displacements;
}

}  // namespace

NodePushes find_node_pushes(const std::vector<const ContactRow*>& rows, const Motion& motion) {
  const std::size_t count = motion.rigid_of_body().size();
  NodePushes pushes{ScratchVector<double>(count, 0), ScratchVector<double>(count, 0),
                    ScratchVector<char>(count, 0)};
  ScratchVector<Side> weighed;
  for (const ContactRow* const row : rows) {
    if (row->normal_impulse == 0) continue;
    for_each_soft_side(*row, motion, [&](const Side& side) {
      double& largest = pushes.largest[side.body];
      largest = std::max(largest, largest_push(side, motion));
      if (has_weight(side, motion)) weighed.push_back(side);
    });
  }
  ScratchVector<Vector3d> displacements;
  if (!weighed.empty()) displacements = find_displacements(rows, motion);
  ScratchVector<double> impulses(count, 0), approaches(count, 0);
  for (const Side& side : weighed) {
    Vector3d moved = Vector3d::Zero();
    for (int k = side.first; k < side.last; ++k)
      moved += side.row->weights[k] * displacements[side.row->contact.vertices[k]];
    const double impulse = side.row->normal_impulse;
    impulses[side.body] += impulse;
    pushes.by_weights[side.body] += impulse * std::max(0.0, side.row->normal.dot(moved));
    approaches[side.body] += impulse * pressing_approach(side, motion);
  }
  for (std::size_t body = 0; body < motion.median_edge().size(); ++body) {
    const double edge = motion.median_edge()[body];  // infinite if most nodes have none
    if (edge > 0 && std::isfinite(edge)) pushes.largest[body] /= edge;
    if (impulses[body] * edge > 0) pushes.by_weights[body] /= impulses[body] * edge;
    pushes.weights_press[body] = approaches[body] > 0;
  }
  return pushes;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
