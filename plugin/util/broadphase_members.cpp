#include "util/broadphase_members.h"

#include <typeinfo>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool BroadphaseMembers::may_have_changed(const btBroadphaseInterface* broadphase) {
  if (!broadphase || typeid(*broadphase) != typeid(btDbvtBroadphase)) return true;
  const auto* const tree = static_cast<const btDbvtBroadphase*>(broadphase);
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

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
