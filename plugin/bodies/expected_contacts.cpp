#include "bodies/expected_contacts.h"

#include <algorithm>

#include "settings.h"
#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void ExpectedContacts::meet(const btSoftBody& body, const btCollisionObject& rigid) {
  if (taken_.empty()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  const Pair pair(&body, &rigid);
  if (met_.empty() || met_.back() != pair) met_.push_back(pair);  // a mesh comes by its triangles
}

bool ExpectedContacts::stays(const Taken& taken, btScalar dt) const {
  if (!taken.rigid) return true;
  const btSoftBody* body = nullptr;
  for (const btSoftBody* const own : taken.bodies)
    if (own) body = own;
  if (!std::binary_search(met_.begin(), met_.end(), Pair{body, taken.rigid}) ||
      !taken.rigid->hasContactResponse())
    return false;
  const btTransform& now = taken.rigid->getWorldTransform();
  if (now == taken.pose) return true;
  const btVector3 normal = now.getBasis() * (taken.pose.getBasis().transpose() * taken.normal);
  return (now * taken.pose.invXform(taken.point)).distance(taken.point) <= jump_speed_ * dt &&
         normal.dot(taken.normal) > btScalar(settings::expected_contacts::min_normal_cosine);
}

void ExpectedContacts::take(Span<const StepContact> contacts,
                            const std::vector<const btSoftBody*>& without, btScalar dt) {
  taken_.clear();
  for (const StepContact& contact : contacts) {
    if (!(contact.impulse > 0)) continue;
    Taken taken;
    taken.rigid = !btSoftBody::upcast(contact.body_a)   ? contact.body_a
                  : !btSoftBody::upcast(contact.body_b) ? contact.body_b
                                                        : nullptr;
    if (taken.rigid) taken.pose = taken.rigid->getWorldTransform();
    taken.speed = 0;
    bool is_known = true;
    for (std::size_t i = 0; i < 4; ++i) {
      const btSoftBody::Node* const node = contact.nodes[i];
      taken.weights[i] = static_cast<btScalar>(contact.weights[i]);
      taken.bodies[i] = nullptr;
      taken.nodes[i] = -1;
      if (!node) continue;
      const bool is_of_a = static_cast<int>(i) < first_vertex_of_b(contact.kind);
      taken.bodies[i] = btSoftBody::upcast(is_of_a ? contact.body_a : contact.body_b);
      taken.nodes[i] = taken.bodies[i] ? index_of(*taken.bodies[i], node) : -1;
      is_known = is_known && taken.nodes[i] >= 0 &&
                 !std::binary_search(without.begin(), without.end(), taken.bodies[i]);
      taken.positions[i] = node->m_x;
      taken.speed += taken.weights[i] * node->m_v.dot(contact.normal);
    }
    if (!is_known) continue;
    taken.point = contact.point;
    taken.normal = contact.normal;
    taken.friction = contact.friction_impulse / dt;
    taken.force = static_cast<btScalar>(contact.impulse) / dt;
    taken_.push_back(taken);
  }
}

bool ExpectedContacts::select(const Bodies& bodies, const std::vector<btScalar>& inverse_mass,
                              btScalar dt) {
  selected_.clear();
  if (taken_.empty()) return false;
  ScratchVector<std::pair<const btSoftBody*, int>> index;
  anchored_.clear();
  for (int b = 0; b < bodies.size(); ++b) {
    const btSoftBody& body = *bodies[b];
    index.emplace_back(&body, b);
    for (int i = 0; i < body.m_deformableAnchors.size(); ++i)
      anchored_.push_back(body.m_deformableAnchors[i].m_node);
  }
  std::sort(index.begin(), index.end());
  std::sort(met_.begin(), met_.end());
  std::sort(anchored_.begin(), anchored_.end());
  for (const Taken& taken : taken_) {
    Selected contact;
    if (stays(taken, dt) && number(taken, index, bodies, inverse_mass, dt, contact))
      selected_.push_back(contact);
  }
  return !selected_.empty();
}

bool ExpectedContacts::number(const Taken& taken,
                              Span<const std::pair<const btSoftBody*, int>> index,
                              const Bodies& bodies, const std::vector<btScalar>& inverse_mass,
                              btScalar dt, Selected& contact) const {
  contact.count = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!taken.bodies[i]) continue;
    const auto at = std::lower_bound(index.begin(), index.end(), std::pair{taken.bodies[i], 0});
    if (at == index.end() || at->first != taken.bodies[i]) return false;
    const btSoftBody& body = *bodies[at->second];
    if (!body.isActive() || taken.nodes[i] >= body.m_nodes.size()) return false;
    const btSoftBody::Node& node = body.m_nodes[taken.nodes[i]];
    if (!(node.m_x == taken.positions[i]) ||
        std::binary_search(anchored_.begin(), anchored_.end(), &node))
      return false;
    const btScalar mobility = inverse_mass[static_cast<std::size_t>(node.index)];
    if (mobility == 0 || taken.weights[i] == 0) continue;
    const auto k = static_cast<std::size_t>(contact.count++);
    contact.nodes[k] = node.index;
    contact.bodies[k] = at->second;
    contact.weights[k] = taken.weights[i];
    contact.inverse_masses[k] = mobility;
  }
  contact.normal = taken.normal;
  contact.friction = taken.friction * dt;
  contact.impulse = taken.force * dt;
  contact.speed = taken.speed;
  contact.penalty = contact.total = 0;
  contact.is_likely = true;
  return contact.count > 0;
}

bool ExpectedContacts::find_penalties(const Multiply& multiply, int size) {
  // The ratio of both inertias is that of a motion as the contacts of the last step gave it to the
  // nodes (Rayleigh quotient).
  probe_.resize(size);
  product_.resize(size);
  for (int i = 0; i < size; ++i) probe_[i].setZero();
  int bodies = 0;
  for (const Selected& contact : selected_) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k) {
      probe_[contact.nodes[k]] +=
          contact.weights[k] * contact.inverse_masses[k] * contact.impulse * contact.normal;
      bodies = std::max(bodies, contact.bodies[k] + 1);
    }
  }
  multiply(probe_, product_);
  // The product at each contact's nodes, so nodes of several contacts count several times.
  ScratchVector<btScalar> of_mass(static_cast<std::size_t>(bodies), 0), of_all = of_mass;
  for (const Selected& contact : selected_) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k) {
      const auto body = static_cast<std::size_t>(contact.bodies[k]);
      const btVector3& velocity = probe_[contact.nodes[k]];
      of_mass[body] += velocity.length2() / contact.inverse_masses[k];
      of_all[body] += velocity.dot(product_[contact.nodes[k]]);
    }
  }
  for (Selected& contact : selected_) {
    btScalar mobility = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k) {
      const auto body = static_cast<std::size_t>(contact.bodies[k]);
      const btScalar ratio = of_mass[body] > 0 ? of_all[body] / of_mass[body] - 1 : btScalar(0);
      mobility += contact.weights[k] * contact.weights[k] * contact.inverse_masses[k] /
                  btMax(ratio, btScalar(settings::expected_contacts::min_damping_ratio));
      if (ratio >= btScalar(settings::expected_contacts::min_damping_ratio)) contact.penalty = 1;
    }
    if (contact.penalty > 0) contact.penalty = 1 / mobility;
  }
  selected_.erase(std::remove_if(selected_.begin(), selected_.end(),
                                 [](const Selected& contact) { return !(contact.penalty > 0); }),
                  selected_.end());
  return !selected_.empty();
}

ScratchVector<std::array<int, 2>> ExpectedContacts::body_pairs() const {
  ScratchVector<std::array<int, 2>> pairs;
  for (const Selected& contact : selected_) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k) {
      const std::array<int, 2> pair = {contact.bodies[0], contact.bodies[k]};
      if (pairs.empty() || pairs.back() != pair) pairs.push_back(pair);
    }
  }
  return pairs;
}

void ExpectedContacts::divide(Span<const EquationIsland> islands) {
  ScratchVector<std::size_t> island_of;  // by body
  for (std::size_t i = 0; i < islands.size(); ++i) {
    for (const int body : islands[i].bodies) {
      island_of.resize(std::max(island_of.size(), static_cast<std::size_t>(body) + 1));
      island_of[static_cast<std::size_t>(body)] = i;
    }
  }
  const auto of = [&](const Selected& contact) {
    return island_of[static_cast<std::size_t>(contact.bodies[0])];
  };
  std::stable_sort(selected_.begin(), selected_.end(),
                   [&](const Selected& a, const Selected& b) { return of(a) < of(b); });
  by_island_.assign(islands.size(), {0, 0});
  std::size_t next = 0;
  for (std::size_t i = 0; i < islands.size(); ++i) {
    by_island_[i].first = next;
    while (next < selected_.size() && of(selected_[next]) == i) ++next;
    by_island_[i].last = next;
  }
}

void ExpectedContacts::guess(const Bodies& bodies, const VectorStack& velocity,
                             VectorStack& dv) const {
  ScratchVector<char> touched(static_cast<std::size_t>(bodies.size()), 0);
  for (const Selected& contact : selected_) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k)
      touched[static_cast<std::size_t>(contact.bodies[k])] = 1;
  }
  for (int b = 0; b < bodies.size(); ++b) {
    if (!touched[static_cast<std::size_t>(b)]) continue;
    const btSoftBody& body = *bodies[b];
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      const btSoftBody::Node& node = body.m_nodes[i];
      if (node.m_im > 0) dv[node.index] = node.m_vn - velocity[node.index];
    }
  }
}

void ExpectedContacts::add_right_hand_side(std::size_t island, const VectorStack& velocity,
                                           VectorStack& right_hand_side) const {
  for (const Selected& contact : of_island(island)) {
    const btScalar along =
        contact.impulse - contact.penalty * (contact.speed_along(velocity) - contact.speed);
    contact.add(along * contact.normal + contact.friction, right_hand_side);
  }
}

void ExpectedContacts::multiply(std::size_t island, const VectorStack& x, VectorStack& b) const {
  for (const Selected& contact : of_island(island)) contact.add(contact.penalty_impulse(x), b);
}

void ExpectedContacts::copy_penalties(std::size_t island, ContactPenalties& penalties) const {
  penalties.clear();
  for (const Selected& contact : of_island(island)) penalties.add(contact);
}

bool ExpectedContacts::drop_unlikely(std::size_t island, const VectorStack& velocity,
                                     const VectorStack& dv) {
  Range& range = by_island_[island];
  Selected* const first = selected_.data() + range.first;
  Selected* const last = selected_.data() + range.last;
  for (Selected* contact = first; contact != last; ++contact) {
    const btScalar before = contact->speed_along(velocity);
    const btScalar after = before + contact->speed_along(dv);
    contact->total = contact->impulse - contact->penalty * (after - contact->speed);
    // Forces have changed the speed of the last step to that of before. A contact takes this change
    // back, and may overshoot by as much. Slow ones do no harm, and each drop costs a solve.
    const btScalar limit = btMax(btScalar(0), contact->speed) + btFabs(before - contact->speed) +
                           btScalar(settings::expected_contacts::min_leaving_speed);
    contact->is_likely = contact->total >= 0 && after <= limit;
  }
  Selected* const unlikely =
      std::remove_if(first, last, [](const Selected& contact) { return !contact.is_likely; });
  range.last = static_cast<std::size_t>(unlikely - selected_.data());
  return unlikely != last;
}

void ExpectedContacts::remove_impulses(VectorStack& dv) const {
  for (std::size_t island = 0; island < by_island_.size(); ++island) {
    for (const Selected& contact : of_island(island)) {
      const btVector3 impulse = contact.total * contact.normal + contact.friction;
      for (std::size_t k = 0; k < static_cast<std::size_t>(contact.count); ++k)
        dv[contact.nodes[k]] -= contact.weights[k] * contact.inverse_masses[k] * impulse;
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
