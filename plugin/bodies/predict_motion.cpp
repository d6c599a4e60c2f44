#include "bodies/predict_motion.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>

#include <vector>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Scope in which bodies have no handle of the broad phase, so that Bullet tells it nothing.
class WithoutBroadphase {
 public:
  explicit WithoutBroadphase(const SideBySide::Bodies& bodies) : bodies_(bodies) {
    for (int i = 0; i < bodies.size(); ++i) {
      handles_.push_back(bodies[i]->getBroadphaseHandle());
      bodies[i]->setBroadphaseHandle(nullptr);
    }
  }
  ~WithoutBroadphase() {
    for (int i = 0; i < bodies_.size(); ++i)
      bodies_[i]->setBroadphaseHandle(handles_[static_cast<std::size_t>(i)]);
  }
  WithoutBroadphase(const WithoutBroadphase&) = delete;
  WithoutBroadphase& operator=(const WithoutBroadphase&) = delete;

 private:
  const SideBySide::Bodies& bodies_;
  std::vector<btBroadphaseProxy*> handles_;
};

}  // namespace

void predict_motions(const SideBySide::Bodies& bodies, const SideBySide& side_by_side,
                     const std::function<void(btSoftBody&)>& predict) {
  std::vector<char> was_active;
  for (int i = 0; i < bodies.size(); ++i) was_active.push_back(bodies[i]->isActive());
  {
    const WithoutBroadphase scope(bodies);
    std::vector<char> is_predicted(was_active.size(), 0);
    for (int i = 0; i < bodies.size(); ++i) {
      if (!was_active[static_cast<std::size_t>(i)] || !bodies[i]->m_bUpdateRtCst) continue;
      predict(*bodies[i]);
      is_predicted[static_cast<std::size_t>(i)] = 1;
    }
    side_by_side.for_each([&](int i) {
      const auto index = static_cast<std::size_t>(i);
      if (was_active[index] && !is_predicted[index]) predict(*bodies[i]);
    });
  }
  for (int i = 0; i < bodies.size(); ++i) {
    const btSoftBody& body = *bodies[i];
    btBroadphaseProxy* const handle = bodies[i]->getBroadphaseHandle();
    if (!was_active[static_cast<std::size_t>(i)] || !handle || body.m_nodes.size() == 0) continue;
    btSoftBodyWorldInfo& info = *body.m_worldInfo;
    info.m_broadphase->setAabb(handle, body.m_bounds[0], body.m_bounds[1], info.m_dispatcher);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
