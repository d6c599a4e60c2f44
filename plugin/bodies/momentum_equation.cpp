#include "bodies/momentum_equation.h"

#include <algorithm>
#include <cmath>
#include <typeinfo>

#include "bodies/ordered_sum.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Islands with fewer nodes than this are solved on one thread each; side by side if they have more
// nodes together.
constexpr std::size_t min_parallel_nodes = 2 * node_grain;

btVector3 inverse_or_zero(const btVector3& v) {
  btVector3 inverse(0, 0, 0);
  for (int k = 0; k < 3; ++k) inverse[k] = v[k] == 0 ? btScalar(0) : btScalar(1.0 / v[k]);
  return inverse;
}

}  // namespace

bool MomentumEquation::solve(btDeformableBackwardEulerObjective& objective, btScalar dt,
                             int max_iterations, btScalar tolerance, const SideBySide& bodies,
                             Span<const int> lost, ExpectedContacts& contacts,
                             VectorStack& residual, VectorStack& dv) {
  objective_ = &objective;
  side_by_side_ = &bodies;
  nodes_ = dv.size();
  if (residual.size() != nodes_ || !read(objective)) return false;
  add_right_hand_side(dt, residual);
  objective.applyDynamicFriction(residual);
  objective.addLagrangeMultiplierRHS(residual, dv, right_hand_side_);
  objective.addLagrangeMultiplier(dv, solution_);
  find_preconditioner();
  if (all_.node_count != static_cast<std::size_t>(nodes_) ||
      all_.unknowns.size() != static_cast<std::size_t>(solution_.size()) ||
      all_.bodies.size() != static_cast<std::size_t>(objective.m_softBodies.size()))
    all_ = whole_equation(objective, nodes_);
  conjugate_residual_.resize(solution_.size());
  const auto multiply_all = [&](const VectorStack& x, VectorStack& b) {
    multiply(all_, x, b, bodies.parallel_for());
  };
  find_apart(lost);
  const bool is_any_expected = !terms_.empty() &&
                               contacts.select(objective.m_softBodies, inverse_mass_, dt) &&
                               contacts.find_penalties(multiply_all, solution_.size());
  if (is_any_expected) {
    solve_with(contacts, max_iterations, tolerance);
  } else if (is_divisible_ && !apart_.empty()) {
    for (const EquationIsland& island : find_equation_islands(objective, nodes_, apart_)) {
      if (!is_finite(island)) continue;
      const auto multiply_island = [&](const VectorStack& x, VectorStack& b) {
        multiply(island, x, b, bodies.parallel_for());
      };
      conjugate_residual_.solve(island.unknowns, multiply_island, preconditioner_, right_hand_side_,
                                solution_, max_iterations, tolerance, bodies.parallel_for());
    }
  } else {
    conjugate_residual_.solve(all_.unknowns, multiply_all, preconditioner_, right_hand_side_,
                              solution_, max_iterations, tolerance, bodies.parallel_for());
  }
  for (int i = 0; i < nodes_; ++i) dv[i] = solution_[i];
  return true;
}

void MomentumEquation::find_apart(Span<const int> lost) {
  apart_.clear();
  for (const int body : lost) apart_.push_back({body, body});
  for (std::size_t body = 0; body < is_finite_.size(); ++body)
    if (!is_finite_[body]) apart_.push_back({static_cast<int>(body), static_cast<int>(body)});
}

bool MomentumEquation::is_finite(const EquationIsland& island) const {
  return !is_divisible_ ||
         std::all_of(island.bodies.begin(), island.bodies.end(),
                     [this](int body) { return is_finite_[static_cast<std::size_t>(body)] != 0; });
}

void MomentumEquation::solve_with(ExpectedContacts& contacts, int max_iterations,
                                  btScalar tolerance) {
  plain_right_hand_side_.copyFromArray(right_hand_side_);
  contacts.guess(objective_->m_softBodies, velocity_, solution_);
  const ScratchVector<EquationIsland> islands = find_islands(contacts);
  contacts.divide(islands);
  const ParallelFor on_one_thread = [](std::size_t count, std::size_t, const auto& body) {
    body(0, count);
  };
  const ParallelFor& on_all = side_by_side_->parallel_for();
  ScratchVector<std::size_t> small;
  std::size_t small_nodes = 0;
  for (std::size_t i = 0; i < islands.size(); ++i) {
    if (!is_finite(islands[i])) continue;
    if (islands.size() == 1 || islands[i].node_count >= min_parallel_nodes) {
      solve_island(islands[i], i, contacts, max_iterations, tolerance, on_all, &penalties_);
    } else {
      small.push_back(i);
      small_nodes += islands[i].node_count;
    }
  }
  for_ranges(small_nodes < min_parallel_nodes ? on_one_thread : on_all, small.size(), 1,
             [&](std::size_t first, std::size_t last) {
               for (std::size_t k = first; k < last; ++k)
                 solve_island(islands[small[k]], small[k], contacts, max_iterations, tolerance,
                              on_one_thread, nullptr);
             });
  contacts.remove_impulses(solution_);
}

void MomentumEquation::solve_island(const EquationIsland& island, std::size_t index,
                                    ExpectedContacts& contacts, int max_iterations,
                                    btScalar tolerance, const ParallelFor& parallel_for,
                                    ContactPenalties* penalties) {
  for (int round = 0;; ++round) {
    if (round == settings::expected_contacts::max_solves) contacts.drop_all(index);
    for (const int i : island.unknowns) right_hand_side_[i] = plain_right_hand_side_[i];
    contacts.add_right_hand_side(index, velocity_, right_hand_side_);
    if (contacts.count(index) < ContactPenalties::min_rows) penalties = nullptr;
    if (penalties != nullptr) contacts.copy_penalties(index, *penalties);
    conjugate_residual_.solve(
        island.unknowns,
        [&](const VectorStack& x, VectorStack& b) {
          multiply(island, x, b, parallel_for);
          if (penalties != nullptr) {
            penalties->multiply(x, b, parallel_for);
          } else {
            contacts.multiply(index, x, b);
          }
        },
        preconditioner_, right_hand_side_, solution_, max_iterations, tolerance, parallel_for);
    if (!contacts.drop_unlikely(index, velocity_, solution_)) break;
  }
}

ScratchVector<EquationIsland> MomentumEquation::find_islands(
    const ExpectedContacts& contacts) const {
  if (!is_divisible_) return {all_};
  ScratchVector<std::array<int, 2>> pairs = contacts.body_pairs();
  pairs.insert(pairs.end(), apart_.begin(), apart_.end());
  return find_equation_islands(*objective_, nodes_, pairs);
}

bool MomentumEquation::read(btDeformableBackwardEulerObjective& objective) {
  if (typeid(objective) != typeid(btDeformableBackwardEulerObjective) || objective.m_implicit ||
      objective.m_preconditioner != objective.m_KKTPreconditioner)
    return false;
  const ParallelFor& parallel_for = side_by_side_->parallel_for();
  const btAlignedObjectArray<btSoftBody*>& bodies = objective.m_softBodies;
  const auto count = static_cast<std::size_t>(nodes_);
  ScratchVector<int> first_node(1, 0);
  for (int i = 0; i < bodies.size(); ++i)
    first_node.push_back(first_node.back() + bodies[i]->m_nodes.size());
  if (first_node.back() != nodes_) return false;
  mass_.resize(count);
  inverse_mass_.resize(count);
  velocity_.resize(nodes_);
  is_finite_.assign(static_cast<std::size_t>(bodies.size()), 1);
  side_by_side_->for_each([&](int b) {
    const btSoftBody& body = *bodies[b];
    const int first = first_node[static_cast<std::size_t>(b)];
    btVector3 sum(0, 0, 0);
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      const btSoftBody::Node& node = body.m_nodes[i];
      const auto index = static_cast<std::size_t>(first + i);
      inverse_mass_[index] = node.m_im;
      mass_[index] = node.m_im == 0 ? btScalar(0) : btScalar(1) / node.m_im;
      velocity_[first + i] = node.m_v;
      sum += node.m_v + node.m_x;
    }
    is_finite_[static_cast<std::size_t>(b)] = std::isfinite(sum.x() + sum.y() + sum.z());
  });
  terms_.clear();
  const btAlignedObjectArray<btDeformableLagrangianForce*>& forces = objective.m_lf;
  springs_.resize(static_cast<std::size_t>(forces.size()));
  has_body_forces_ = false;
  bool has_others = false;
  for (int i = 0; i < forces.size(); ++i) {
    btDeformableLagrangianForce& force = *forces[i];
    if (typeid(force) == typeid(btDeformableGravityForce)) continue;  // does not damp
    Term term{i, &force, nullptr};
    if (typeid(force) == typeid(btDeformableMassSpringForce)) {
      const auto& spring_force = static_cast<const btDeformableMassSpringForce&>(force);
      SpringDamping& springs = springs_[static_cast<std::size_t>(i)];
      if (springs.read(spring_force, probe_.read(spring_force), nodes_, parallel_for))
        term.springs = &springs;
    }
    has_others = has_others || !term.springs;
    terms_.push_back(term);
  }
  if (has_others) has_body_forces_ = body_forces_.read(forces, bodies);
  is_divisible_ = !has_others || has_body_forces_;
  return true;
}

void MomentumEquation::add_right_hand_side(btScalar dt, VectorStack& residual) const {
  for (const Term& term : terms_) {
    if (term.springs) {
      for_ranges(side_by_side_->parallel_for(), static_cast<std::size_t>(nodes_), node_grain,
                 [&](std::size_t first, std::size_t last) {
                   for (int i = static_cast<int>(first); i < static_cast<int>(last); ++i)
                     term.springs->add_row(i, dt, velocity_, residual[i]);
                 });
    } else if (term.force->getForceType() == BT_MOUSE_PICKING_FORCE) {
      term.force->addScaledForces(dt, residual);
    } else {
      term.force->addScaledDampingForce(dt, residual);
    }
  }
}

// The inverse of the diagonal, and that of the Schur complement for the multipliers.
void MomentumEquation::find_preconditioner() {
  const btScalar scale = -objective_->m_dt;
  VectorStack& diagonal = preconditioner_;
  diagonal.resize(nodes_);
  const auto for_nodes = [&](const auto& visit) {
    for_ranges(side_by_side_->parallel_for(), static_cast<std::size_t>(nodes_), 2 * node_grain,
               [&](std::size_t first, std::size_t last) {
                 for (int i = static_cast<int>(first); i < static_cast<int>(last); ++i) visit(i);
               });
  };
  for_nodes([&](int i) {
    const btScalar im = inverse_mass_[static_cast<std::size_t>(i)];
    const btScalar mass = im == 0 ? btScalar(0) : btScalar(1.0 / im);
    diagonal[i] = btVector3(mass, mass, mass);
  });
  for (const Term& term : terms_) {
    if (!term.springs) {
      term.force->buildDampingForceDifferentialDiagonal(scale, diagonal);
      continue;
    }
    for_nodes([&](int i) {
      if (inverse_mass_[static_cast<std::size_t>(i)] > 0)
        term.springs->subtract_diagonal(i, scale, diagonal[i]);
    });
  }
  for_nodes([&](int i) { diagonal[i] = inverse_or_zero(diagonal[i]); });
  const btAlignedObjectArray<LagrangeMultiplier>& multipliers =
      objective_->m_projection.m_lagrangeMultipliers;
  preconditioner_.resize(nodes_ + multipliers.size());
  for (int c = 0; c < multipliers.size(); ++c) {
    const LagrangeMultiplier& multiplier = multipliers[c];
    btVector3 schur(0, 0, 0);
    for (int j = 0; j < multiplier.m_num_constraints; ++j) {
      for (int i = 0; i < multiplier.m_num_nodes; ++i) {
        const btVector3& inverse = preconditioner_[multiplier.m_indices[i]];
        const btVector3& direction = multiplier.m_dirs[j];
        const btScalar weight = multiplier.m_weights[i];
        for (int k = 0; k < 3; ++k)
          schur[j] += inverse[k] * direction[k] * direction[k] * weight * weight;
      }
    }
    preconditioner_[nodes_ + c] = inverse_or_zero(schur);
  }
}

void MomentumEquation::multiply(const EquationIsland& island, const VectorStack& x, VectorStack& b,
                                const ParallelFor& parallel_for) const {
  const btScalar scale = -objective_->m_dt;
  const SpringDamping* const springs = terms_.empty() ? nullptr : terms_.front().springs;
  for_ranges(parallel_for, island.node_count, node_grain, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const int node = island.unknowns[k];
      const auto i = static_cast<std::size_t>(node);
      btVector3 sum = inverse_mass_[i] == 0 ? btVector3(0, 0, 0) : x[node] * mass_[i];
      if (springs) springs->add_row(node, scale, x, sum);
      b[node] = sum;
    }
  });
  for (std::size_t t = springs ? 1 : 0; t < terms_.size(); ++t)
    add_damping(terms_[t], island, x, b, parallel_for);
  multiply_multipliers(island, x, b);
}

void MomentumEquation::add_damping(const Term& term, const EquationIsland& island,
                                   const VectorStack& x, VectorStack& b,
                                   const ParallelFor& parallel_for) const {
  const btScalar dt = objective_->m_dt;
  const auto add_body = [&](int body) {
    for (const BodyForces::Acting& acting : body_forces_.on(body))
      if (acting.force == term.index) acting.copy->addScaledDampingForceDifferential(-dt, x, b);
  };
  if (term.springs) {
    for_ranges(parallel_for, island.node_count, node_grain,
               [&](std::size_t first, std::size_t last) {
                 for (std::size_t k = first; k < last; ++k)
                   term.springs->add_row(island.unknowns[k], -dt, x, b[island.unknowns[k]]);
               });
  } else if (!has_body_forces_) {
    term.force->addScaledDampingForceDifferential(-dt, x, b);
    if (term.force->getForceType() == BT_MOUSE_PICKING_FORCE)
      term.force->addScaledElasticForceDifferential(-dt * dt, x, b);
  } else if (island.bodies.size() == all_.bodies.size()) {
    side_by_side_->for_each(add_body);
  } else {
    for_ranges(parallel_for, island.bodies.size(), 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k) add_body(island.bodies[k]);
    });
  }
}

void MomentumEquation::multiply_multipliers(const EquationIsland& island, const VectorStack& x,
                                            VectorStack& b) const {
  for (const int unknown : island.multipliers()) {
    const LagrangeMultiplier& m = objective_->m_projection.m_lagrangeMultipliers[unknown - nodes_];
    btVector3& row = b[unknown];
    row.setZero();
    for (int i = 0; i < m.m_num_nodes; ++i)
      for (int j = 0; j < m.m_num_constraints; ++j)
        b[m.m_indices[i]] += x[unknown][j] * m.m_weights[i] * m.m_dirs[j];
    for (int j = 0; j < m.m_num_constraints; ++j)
      for (int i = 0; i < m.m_num_nodes; ++i)
        row[j] += m.m_weights[i] * x[m.m_indices[i]].dot(m.m_dirs[j]);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
