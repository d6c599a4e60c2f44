#include "scene/previous_step.h"

#include <algorithm>
#include <functional>
#include <unordered_set>
#include <utility>

#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Metres.
btScalar largest_pinned_displacement(const SoftScene::BodyRecord& record, const Motion& motion) {
  btScalar squared = 0;
  for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v) {
    if (motion.inverse_mass()[v] > 0) continue;
    const auto at = 3 * static_cast<std::size_t>(v);
    btScalar sum = 0;
    for (std::size_t k = at; k < at + 3; ++k)
      sum += (motion.end[k] - motion.start()[k]) * (motion.end[k] - motion.start()[k]);
    squared = btMax(squared, sum);
  }
  return btSqrt(squared);
}

}  // namespace

bool PreviousStep::SoftBody::is_of(const SoftScene::BodyRecord& record) const {
  return body == record.body && proxy_id == bullet::proxy_id(*record.body);
}

void PreviousStep::remember(const SoftScene& scene, const Sleepers& sleepers,
                            const Obstacles& obstacles, const StepTopology& topology,
                            const Motion& motion) {
  if (!std::equal(soft_bodies_.begin(), soft_bodies_.end(), scene.bodies().begin(),
                  scene.bodies().end(), std::mem_fn(&SoftBody::is_of)))
    set_aside(sleepers);
  soft_bodies_.resize(scene.bodies().size());
  next_ = 0;
  for (std::size_t i = 0; i < soft_bodies_.size(); ++i) {
    const SoftScene::BodyRecord& record = scene.bodies()[i];
    const auto first = motion.end.begin() + 3 * static_cast<std::ptrdiff_t>(record.first_vertex);
    soft_bodies_[i].body = record.body;
    soft_bodies_[i].proxy_id = bullet::proxy_id(*record.body);
    soft_bodies_[i].positions.assign(first,
                                     first + 3 * static_cast<std::ptrdiff_t>(record.vertex_count));
    soft_bodies_[i].pinned_displacement = largest_pinned_displacement(record, motion);
  }
  obstacles_.clear();
  for (const Obstacles::Record& record : obstacles.records())
    obstacles_.push_back({record.unique_id, record.end});
  for (const StepTopology::BodyRecord& body : topology.bodies()) {
    if (!body.soft)
      obstacles_[static_cast<std::size_t>(body.obstacle)].end =
          motion.rigid_of(topology.index_of(body)).end;
  }
}

// Keeps the bodies of the last step that were left out of this one.
void PreviousStep::set_aside(const Sleepers& sleepers) {
  const std::vector<const btSoftBody*> sleeping = sleepers.left_out();
  const std::unordered_set<const btSoftBody*> left_out(sleeping.begin(), sleeping.end());
  const auto has_woken = [&](const SoftBody& last) { return left_out.count(last.body) == 0; };
  left_out_.erase(std::remove_if(left_out_.begin(), left_out_.end(), has_woken), left_out_.end());
  for (SoftBody& last : soft_bodies_)
    if (!has_woken(last)) left_out_.push_back(std::move(last));
}

const PreviousStep::SoftBody* PreviousStep::find(const SoftScene::BodyRecord& record) {
  const auto is_same = [&record](const SoftBody& last) { return last.is_of(record); };
  auto last =
      soft_bodies_.begin() + static_cast<std::ptrdiff_t>(std::min(next_, soft_bodies_.size()));
  if (last == soft_bodies_.end() || !is_same(*last))
    last = std::find_if(soft_bodies_.begin(), soft_bodies_.end(), is_same);
  if (last != soft_bodies_.end()) {
    next_ = static_cast<std::size_t>(last - soft_bodies_.begin()) + 1;
    return &*last;
  }
  const auto left_out = std::find_if(left_out_.begin(), left_out_.end(), is_same);
  return left_out == left_out_.end() ? nullptr : &*left_out;
}

const std::vector<btScalar>* PreviousStep::end_of(const SoftScene::BodyRecord& record) {
  const SoftBody* const last = find(record);
  if (!last || last->positions.size() != 3 * static_cast<std::size_t>(record.vertex_count))
    return nullptr;
  pinned_displacement_ = last->pinned_displacement;
  return &last->positions;
}

void PreviousStep::forget(const btCollisionObject& body) {
  for (std::vector<SoftBody>* const bodies : {&soft_bodies_, &left_out_}) {
    bodies->erase(std::remove_if(bodies->begin(), bodies->end(),
                                 [&](const SoftBody& last) { return last.body == &body; }),
                  bodies->end());
  }
}

bool PreviousStep::is_new(const Obstacles::Record& obstacle) const {
  const auto is_before = [](const Obstacle& last, int id) { return last.unique_id < id; };
  const auto last =
      std::lower_bound(obstacles_.begin(), obstacles_.end(), obstacle.unique_id, is_before);
  if (last == obstacles_.end() || last->unique_id != obstacle.unique_id) return true;
  return obstacle.is_changed || obstacle.jumped ||
         (obstacle.dynamic && !(obstacle.start == last->end));
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
