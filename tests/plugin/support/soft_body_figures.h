// Figures of a soft body that tests look at.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>

namespace lazyccd::test {

/// Of the fastest node, m/s.
inline double speed(const btSoftBody& body) {
  double fastest = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    fastest = std::max(fastest, static_cast<double>(body.m_nodes[i].m_v.length()));
  return fastest;
}

/// Length of the most strained link, over its rest length.
inline double strain(const btSoftBody& body) {
  double largest = 0;
  for (int i = 0; i < body.m_links.size(); ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    const btScalar length = link.m_n[0]->m_x.distance(link.m_n[1]->m_x);
    largest = std::max(largest, static_cast<double>(length / link.m_rl));
  }
  return largest;
}

}  // namespace lazyccd::test
