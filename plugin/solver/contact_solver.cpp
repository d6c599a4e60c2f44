// What the impulses of the contact solver do to the motion.
#include "solver/contact_solver.h"

#include <algorithm>

#include "contact/rigid_terms.h"
#include "lazyccd/debug/assert.h"
#include "motion/articulated_motion.h"
#include "solver/contact_solver_parts.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void ContactSolver::write(Motion& motion) {
  const auto for_each_vertex = [this](const auto& each) {
    for_each(block_count_, [&](std::size_t i, int) {
      if (!is_selected(blocks_[i])) return;
      for (const std::int32_t v : blocks_[i].new_vertices) each(v);
    });
  };
  for_each_vertex([&](std::int32_t v) {
    if (for_split_impulse_) {
      motion.split_displacement[v].setZero();
    } else {
      motion.solved[v] = motion.predicted[v] + motion.link_displacement[v];
    }
  });
  for (std::size_t i = 0; i < motion.rigid().size(); ++i) {
    if (!moves(i)) continue;
    RigidSolution& solution = motion.solution_of(motion.rigid()[i]);
    translation_of(solution).setZero();
    rotation_of(solution).setZero();
  }
  for (ArticulatedMotion& body : motion.articulated) {
    if (moves(body.links.front().rigid)) body.clear_impulse(for_split_impulse_);
  }
  written_.resize(displacement_.size());
  for_each_block_by_stage(
      [&](const RowBlock& block, int worker) {
        if (is_selected(block)) write(block, motion, scratch_[static_cast<std::size_t>(worker)]);
      },
      [&](const SharedSlots& shared, const SharedSlots::Grain& grain) {
        if (islands_->is_selected(grain.island)) write(shared, grain, motion);
      });
  for_each_vertex([&](std::int32_t v) {
    LAZYCCD_ASSERT(motion.solved[v].allFinite() && motion.split_displacement[v].allFinite(),
                   "the solver moves nodes to finite positions");
    motion.round_end(v);
  });
  for (ArticulatedMotion& body : motion.articulated) {
    if (!moves(body.links.front().rigid)) continue;
    body.set_displacement(for_split_impulse_);
    for (const ArticulatedMotion::Link& link : body.links) {
      const Vector6d moved = body.displacement_of(link, for_split_impulse_);
      RigidSolution& solution = motion.solution_of(motion.rigid()[link.rigid]);
      translation_of(solution) = moved.head<3>();
      rotation_of(solution) = moved.tail<3>();
    }
  }
}

Vector3d& ContactSolver::translation_of(RigidSolution& body) const {
  return for_split_impulse_ ? body.split_translation : body.translation;
}

Vector3d& ContactSolver::rotation_of(RigidSolution& body) const {
  return for_split_impulse_ ? body.split_rotation : body.rotation;
}

void ContactSolver::write(const RowBlock& block, Motion& motion, Scratch& scratch) {
  RowList& rows = *rows_;
  const Problem& problem = problems_[block.island];
  const double unit = problem.mass_unit * problem.length_unit;
  map_copies(block, scratch);
  for (std::size_t i = 0; i < block.shared.size(); ++i) written_[block.copy(i)].setZero();
  auto& soft = for_split_impulse_ ? motion.split_displacement : motion.solved;
  for (std::size_t b = 0; b < block.batches.size(); ++b) {
    const RowBatches::Batch& batch_rows = block.batch_rows[b];
    for (int i = 0; i < RowBatch::lanes && batch_rows[i] != RowBatches::none; ++i) {
      ContactRow& row = rows[batch_rows[i]];
      const float* solved = block.batches[b].impulse + 4 * i;
      (for_split_impulse_ ? row.split_impulse : row.normal_impulse) =
          unit * static_cast<double>(solved[3]);
      if (!for_split_impulse_) row.tangent_impulse = unit * vector_of(solved);
      LAZYCCD_ASSERT(row.normal_impulse >= 0 && row.split_impulse >= 0, "contacts push");
      if (!has_impulse(row)) continue;
      const Vector3d impulse = for_split_impulse_ ? row.split_impulse * row.normal : row.impulse();
      for (int k = 0; k < 4; ++k) {
        const std::int32_t v = row.contact.vertices[k];
        const double mobility = row.weights[k] * motion.inverse_mass_of(v);
        if (mobility == 0) continue;
        const std::int32_t copy = scratch.copy_of[node_of_[v]];
        (copy != 0 ? written_[copy] : soft[v]) += mobility * impulse;
      }
      if (!has_rigid_terms_) continue;
      for (const RigidTerm& term : RigidTerms(row.contact, row.weights, motion)) {
        const RigidMotion& body = motion.rigid()[term.body];
        if (body.articulated < 0) {
          const std::int32_t copy = scratch.copy_of[translation_slot(term.body)];
          RigidSolution& solution = motion.solution_of(body);
          term.apply_impulse(body, impulse, copy != 0 ? written_[copy] : translation_of(solution),
                             copy != 0 ? written_[copy + 1] : rotation_of(solution));
          continue;
        }
        ArticulatedMotion& multibody = motion.articulated[body.articulated];
        multibody.add_impulse(multibody.link_of(term.body), term.wrench_of(impulse),
                              for_split_impulse_);
      }
    }
  }
  unmap_copies(block, scratch);
}

void ContactSolver::write(const SharedSlots& shared, const SharedSlots::Grain& grain,
                          Motion& motion) const {
  const auto moved = [&](std::int32_t slot) -> Vector3d& {
    const std::int32_t v = vertex_of_[slot];
    if (v >= 0) return (for_split_impulse_ ? motion.split_displacement : motion.solved)[v];
    RigidSolution& body = motion.solution_of(motion.rigid()[body_of_slot(slot)]);
    return slot == translation_slot(body_of_slot(slot)) ? translation_of(body) : rotation_of(body);
  };
  for (std::size_t i = grain.first; i < grain.last; ++i) {
    Vector3d& sum = moved(shared.slot(i));
    for (const std::int32_t copy : shared.copies(i)) sum += written_[copy];
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
