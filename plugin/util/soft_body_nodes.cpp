#include "util/soft_body_nodes.h"

#include <cmath>
#include <functional>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

int index_of(const btSoftBody& body, const btSoftBody::Node* node) {
  if (body.m_nodes.size() == 0) return -1;
  const btSoftBody::Node* first = &body.m_nodes[0];
  const bool inside =
      !std::less<>()(node, first) && std::less<>()(node, first + body.m_nodes.size());
  return inside ? static_cast<int>(node - first) : -1;
}

int proxy_id(const btSoftBody& body) {
  const btBroadphaseProxy* const proxy = body.getBroadphaseHandle();
  return proxy ? proxy->m_uniqueId : -1;
}

bool is_finite(const btSoftBody& body) {
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    const btSoftBody::Node& node = body.m_nodes[i];
    for (int k = 0; k < 3; ++k) {
      if (!std::isfinite(node.m_x[k]) || !std::isfinite(node.m_v[k])) return false;
    }
  }
  return true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
