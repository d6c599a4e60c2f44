#include "util/broadphase_members.h"

#include <typeinfo>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

const btDbvtBroadphase* usual(const btBroadphaseInterface* broadphase) {
  return broadphase && typeid(*broadphase) == typeid(btDbvtBroadphase)
             ? static_cast<const btDbvtBroadphase*>(broadphase)
             : nullptr;
}

}  // namespace

bool BroadphaseMembers::may_have_changed(const btBroadphaseInterface* broadphase) {
  const btDbvtBroadphase* const tree = usual(broadphase);
  if (!tree) return true;
  const int count = tree->m_sets[0].m_leaves + tree->m_sets[1].m_leaves;
  // A proxy that is added has a new id. resetPool() starts both counters over.
  const bool is_same =
      tree == tree_ && count == count_ && tree->m_gid == last_id_ && tree->m_pid >= collisions_;
  tree_ = tree;
  count_ = count;
  last_id_ = tree->m_gid;
  collisions_ = tree->m_pid;
  return !is_same;
}

void for_each_proxy(btBroadphaseInterface* broadphase,
                    const std::function<void(const btBroadphaseProxy&)>& visit) {
  if (const btDbvtBroadphase* const tree = usual(broadphase)) {
    for (const btDbvtProxy* stage : tree->m_stageRoots)
      for (; stage; stage = stage->links[1]) visit(*stage);
  } else if (broadphase) {
    struct Visitor : btBroadphaseAabbCallback {
      explicit Visitor(const std::function<void(const btBroadphaseProxy&)>& v) : visit(v) {}
      bool process(const btBroadphaseProxy* proxy) override {
        visit(*proxy);
        return true;
      }
      const std::function<void(const btBroadphaseProxy&)>& visit;
    } visitor(visit);
    const btScalar far = BT_LARGE_FLOAT;
    broadphase->aabbTest(btVector3(-far, -far, -far), btVector3(far, far, far), visitor);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
