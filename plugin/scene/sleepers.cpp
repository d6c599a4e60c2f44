#include "scene/sleepers.h"

#include <algorithm>
#include <utility>

#include "settings.h"
#include "util/soft_body_nodes.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// False also if something awake moves anchored nodes of the body.
bool may_be_left_out(const btSoftBody& body) {
  if (body.getActivationState() != ISLAND_SLEEPING) return false;
  for (int i = 0; i < body.m_deformableAnchors.size(); ++i)
    if (body.m_deformableAnchors[i].m_cti.m_colObj->isActive()) return false;
  return true;
}

template <class IsTrue>
bool any_node(const btSoftBody& body, IsTrue is_true) {
  for (int i = 0; i < body.m_nodes.size(); ++i)
    if (is_true(body.m_nodes[i])) return true;
  return false;
}

// Bullet's deformable world moves sleeping nodes by their velocity, which it clears after a step,
// and by their split velocity, which it does not clear.
bool has_velocity(const btSoftBody& body) {
  return any_node(body, [](const btSoftBody::Node& node) { return !node.m_v.isZero(); });
}
bool has_split_velocity(const btSoftBody& body) {
  return any_node(body, [](const btSoftBody::Node& node) { return !node.m_splitv.isZero(); });
}

AxisBox bounds_of_nodes(const btSoftBody& body) {
  AxisBox bounds = AxisBox::empty();
  for (int i = 0; i < body.m_nodes.size(); ++i) bounds.add(body.m_nodes[i].m_x);
  return bounds;
}

// The first, the last and the middle node, and some of those that are pinned: applications drive
// these.
std::vector<int> nodes_to_sample(const btSoftBody& body) {
  const int count = body.m_nodes.size();
  if (count == 0) return {};
  std::vector<int> nodes = {0, count / 2, count - 1}, pinned;
  for (int i = 0; i < count; ++i)
    if (!(body.m_nodes[i].m_im > 0)) pinned.push_back(i);
  const std::size_t stride =
      std::max<std::size_t>(1, pinned.size() / settings::sleeping::pinned_samples);
  for (std::size_t i = 0; i < pinned.size(); i += stride) nodes.push_back(pinned[i]);
  return nodes;
}

// Calls visit(vector) for all that shows a change of the body, until it returns false. Returns
// whether it never did.
template <class Visit>
bool visit_sample(const btSoftBody& body, const std::vector<int>& nodes, Visit visit) {
  if (!visit(body.m_bounds[0]) || !visit(body.m_bounds[1])) return false;
  for (const int node : nodes)
    if (!visit(body.m_nodes[node].m_x) || !visit(body.m_nodes[node].m_v)) return false;
  for (int i = 0; i < body.m_deformableAnchors.size(); ++i)
    if (!visit(body.m_deformableAnchors[i].m_cti.m_colObj->getWorldTransform().getOrigin()))
      return false;
  return true;
}

bool reaches(const Sleepers::Boxes& awake, const AxisBox& bounds, btScalar distance) {
  const AxisBox near = bounds.expanded(btVector3(distance, distance, distance));
  return std::any_of(awake.begin(), awake.end(),
                     [&](const AxisBox& box) { return near.overlaps(box); });
}

}  // namespace

Sleepers::Sleeper::Sleeper(btSoftBody& b)
    : body(&b),
      proxy_id(bullet::proxy_id(b)),
      bounds(bounds_of_nodes(b)),
      margin(b.getCollisionShape()->getMargin()),
      drifts(has_split_velocity(b)),
      nodes(b.m_nodes.size() > 0 ? &b.m_nodes[0] : nullptr),
      sampled_nodes(nodes_to_sample(b)),
      node_count(b.m_nodes.size()),
      steps_alone(has_velocity(b) ? 0 : settings::sleeping::min_steps_alone) {
  visit_sample(b, sampled_nodes, [this](const btVector3& value) {
    sample.push_back(value);
    return true;
  });
}

bool Sleepers::Sleeper::is_changed() const {
  if (proxy_id != bullet::proxy_id(*body) || node_count != body->m_nodes.size()) return true;
  std::size_t next = 0;
  const bool same = visit_sample(*body, sampled_nodes, [&](const btVector3& value) {
    return next < sample.size() && sample[next++] == value;
  });
  return !same || next != sample.size();
}

bool Sleepers::Sleeper::is_left_out() const {
  return !drifts && steps_alone >= settings::sleeping::min_steps_alone;
}

void Sleepers::Sleeper::prefetch() const {
#if defined(__GNUC__)
  for (const void* const part :
       {static_cast<const void*>(&body->m_bounds), static_cast<const void*>(&body->m_nodes),
        static_cast<const void*>(&body->m_deformableAnchors),
        static_cast<const void*>(sample.data())})
    __builtin_prefetch(part);
  for (const int node : sampled_nodes) __builtin_prefetch(&nodes[node].m_x);
#endif
}

bool Sleepers::are_same(const Bodies& bodies) const {
  constexpr std::ptrdiff_t ahead = 8;
  auto next = sleepers_.begin();
  for (int i = 0; i < bodies.size(); ++i) {
    if (sleepers_.end() - next > ahead) next[ahead].prefetch();
    if (!may_be_left_out(*bodies[i])) continue;
    if (next == sleepers_.end() || next->body != bodies[i] || next->is_changed()) return false;
    ++next;
  }
  return next == sleepers_.end();
}

void Sleepers::begin_step(const Bodies& bodies) {
  if (are_same(bodies)) return;
  std::vector<Sleeper> before = std::move(sleepers_);
  sleepers_.clear();
  auto next = before.begin();
  for (int i = 0; i < bodies.size(); ++i) {
    btSoftBody& body = *bodies[i];
    if (!may_be_left_out(body)) continue;
    const auto is_same = [&body](const Sleeper& sleeper) { return sleeper.body == &body; };
    if (next == before.end() || !is_same(*next))
      next = std::find_if(before.begin(), before.end(), is_same);
    if (next != before.end() && !next->is_changed()) {
      sleepers_.push_back(std::move(*next));
    } else {
      sleepers_.emplace_back(body);
    }
    if (next != before.end()) ++next;
  }
}

void Sleepers::find_members(const Bodies& bodies) {
  members_.clear();
  left_out_count_ = 0;
  largest_margin_ = 0;
  std::size_t kept = 0, next = 0;
  for (int i = 0; i < bodies.size(); ++i) {
    const bool slept = next < sleepers_.size() && sleepers_[next].body == bodies[i];
    const bool sleeps = slept && bodies[i]->getActivationState() == ISLAND_SLEEPING;
    if (sleeps && sleepers_[next].is_left_out()) {
      ++left_out_count_;
    } else {
      members_.push_back({bodies[i], i, sleeps});
    }
    if (sleeps) largest_margin_ = btMax(largest_margin_, sleepers_[next].margin);
    if (sleeps && kept != next) sleepers_[kept] = std::move(sleepers_[next]);
    kept += sleeps;
    next += slept;
  }
  sleepers_.erase(sleepers_.begin() + static_cast<std::ptrdiff_t>(kept), sleepers_.end());
}

std::vector<const btSoftBody*> Sleepers::left_out() const {
  std::vector<const btSoftBody*> bodies;
  for (const Sleeper& sleeper : sleepers_)
    if (sleeper.is_left_out()) bodies.push_back(sleeper.body);
  return bodies;
}

bool Sleepers::take_in(const Bodies& bodies, const Boxes& awake, btScalar distance) {
  if (left_out_count_ == 0) return false;
  bool any = false;
  for (Sleeper& sleeper : sleepers_) {
    if (!sleeper.is_left_out() || !reaches(awake, sleeper.bounds, distance)) continue;
    sleeper.steps_alone = 0;
    any = true;
  }
  if (any) find_members(bodies);
  return any;
}

void Sleepers::end_step(const Boxes& awake, btScalar distance) {
  for (Sleeper& sleeper : sleepers_) {
    if (sleeper.is_left_out()) continue;
    sleeper.steps_alone = reaches(awake, sleeper.bounds, distance) ? 0 : sleeper.steps_alone + 1;
  }
}

void Sleepers::forget(const btCollisionObject& body) {
  sleepers_.erase(std::remove_if(sleepers_.begin(), sleepers_.end(),
                                 [&body](const Sleeper& s) { return s.body == &body; }),
                  sleepers_.end());
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
