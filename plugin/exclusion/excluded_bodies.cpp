#include "exclusion/excluded_bodies.h"

#include <algorithm>
#include <string>

#include "shapes/axis_box.h"
#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Whether a force of Bullet acts on the volume of tetrahedra.
bool is_elastic(btDeformableLagrangianForce& force) {
  const btDeformableLagrangianForceType type = force.getForceType();
  return type == BT_NEOHOOKEAN_FORCE || type == BT_LINEAR_ELASTICITY_FORCE ||
         type == BT_COROTATED_FORCE;
}

// A node around which the volumes of the tetrahedra at rest add up to less than zero; -1 if there
// is none. A force in proportion to the volume drives such a node away from its place. A few
// inverted tetrahedra among larger ones are held by these.
int find_inverted_node(const btSoftBody& body) {
  std::vector<btScalar> volumes;
  for (int i = 0; i < body.m_tetras.size(); ++i) {
    const btSoftBody::Tetra& tetra = body.m_tetras[i];
    if (volumes.empty() && !(tetra.m_element_measure < 0)) continue;
    if (volumes.empty()) {
      volumes.assign(static_cast<std::size_t>(body.m_nodes.size()), 0);
      i = -1;  // from the first one again
      continue;
    }
    for (const btSoftBody::Node* const corner : tetra.m_n) {
      const int node = index_of(body, corner);
      if (node >= 0) volumes[static_cast<std::size_t>(node)] += tetra.m_element_measure;
    }
  }
  const auto found =
      std::find_if(volumes.begin(), volumes.end(), [](btScalar volume) { return volume < 0; });
  return found == volumes.end() ? -1 : static_cast<int>(found - volumes.begin());
}

// Whether the bounds are larger than Bullet accepts (btCollisionWorld::updateSingleAabb). It
// disables such a body, or at least no longer updates it in the broad phase. Of a disabled body the
// bounds stay as they were, so the nodes decide.
bool overflows(const btSoftBody& body) {
  constexpr btScalar largest_diagonal_squared = btScalar(1e12);  // Bullet's, m^2
  const auto is_too_large = [](const AxisBox& box) {
    return !((box.upper - box.lower).length2() < largest_diagonal_squared);
  };
  if (!is_too_large({body.m_bounds[0], body.m_bounds[1]})) return false;
  AxisBox nodes = AxisBox::empty();
  for (int i = 0; i < body.m_nodes.size(); ++i) nodes.add(body.m_nodes[i].m_x);
  return is_too_large(nodes);
}

const char* words_for(ExclusionReason reason) {
  switch (reason) {
    case ExclusionReason::not_finite:
      return "the position is not finite";
    case ExclusionReason::overflow:
      return "its bounds are larger than Bullet accepts";
    case ExclusionReason::inverted:
      return "tetrahedra are inverted at rest, so their forces push them apart; turn them by "
             "exchanging two of their nodes, then call initializeDmInverse()";
    case ExclusionReason::unresolved_step:
      return "it moves 500 m in a step, or farther than its coordinates can resolve";
  }
  return "";
}

}  // namespace

bool ExcludedBodies::Entry::is_still_wrong() const {
  switch (reason) {
    case ExclusionReason::not_finite:
      return !is_finite(*body);
    case ExclusionReason::overflow:
      return overflows(*body);
    case ExclusionReason::inverted:
      return find_inverted_node(*body) >= 0;
    case ExclusionReason::unresolved_step:
      return node < body->m_nodes.size() &&
             !(static_cast<double>(body->m_nodes[node].m_v.length()) <= largest_speed &&
               is_finite(*body));
  }
  return false;
}

void ExcludedBodies::begin_step(const Bodies& bodies, const Forces* forces, WarningLog& warnings) {
  const auto is_gone = [&bodies](const Entry& entry) {  // perhaps deleted
    return bodies.findLinearSearch(entry.body) == bodies.size();
  };
  excluded_.erase(
      std::remove_if(excluded_.begin(), excluded_.end(),
                     [&](const Entry& entry) { return is_gone(entry) || !entry.is_still_wrong(); }),
      excluded_.end());
  for (int i = 0; i < bodies.size(); ++i)
    if (overflows(*bodies[i])) add(*bodies[i], i, -1, ExclusionReason::overflow, warnings);
  if (forces) find_inverted(bodies, *forces, warnings);
}

void ExcludedBodies::find_inverted(const Bodies& bodies, const Forces& forces,
                                   WarningLog& warnings) {
  std::size_t count = 0;  // a body with two forces counts twice
  for (int f = 0; f < forces.size(); ++f) {
    if (!is_elastic(*forces[f])) continue;
    for (int i = 0; i < forces[f]->m_softBodies.size(); ++i, ++count) {
      btSoftBody& body = *forces[f]->m_softBodies[i];
      const Signs signs{proxy_id(body), body.m_tetras.size()};
      Signs& known = elastic_.try_emplace(&body, Signs{-1, -1}).first->second;
      if (known.proxy_id == signs.proxy_id && known.tetra_count == signs.tetra_count) continue;
      known = signs;
      const int world_index = bodies.findLinearSearch(&body), node = find_inverted_node(body);
      if (node >= 0 && world_index < bodies.size())
        add(body, world_index, node, ExclusionReason::inverted, warnings);
    }
  }
  if (elastic_.size() > count) elastic_.clear();  // some are gone; the next step looks again
}

void ExcludedBodies::add(btSoftBody& body, int world_index, int node, ExclusionReason reason,
                         WarningLog& warnings, double largest_speed) {
  if (contains(&body)) return;
  Entry entry;
  static_cast<ExcludedBody&>(entry) = {&body, node, reason};
  entry.largest_speed = largest_speed;
  excluded_.push_back(entry);
  const std::string name = "soft body " + std::to_string(world_index);
  warnings.warn_once("excluded " + name + words_for(reason),
                     name + (node >= 0 ? ", node " + std::to_string(node) : std::string()) + ": " +
                         words_for(reason) +
                         "; collision detection leaves the body out until this ends");
}

bool ExcludedBodies::contains(const btSoftBody* body) const {
  return std::any_of(excluded_.begin(), excluded_.end(),
                     [body](const Entry& entry) { return entry.body == body; });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
