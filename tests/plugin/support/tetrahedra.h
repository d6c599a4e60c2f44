// Bodies of tetrahedra for Bullet's elastic forces.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <utility>

namespace lazyccd::test {

/// Gives all tetrahedra the orientation that Bullet's elastic forces need.
inline void orient_tetrahedra(btSoftBody& body) {
  for (int i = 0; i < body.m_tetras.size(); ++i) {
    btSoftBody::Tetra& tetra = body.m_tetras[i];
    if (tetra.m_element_measure < 0) std::swap(tetra.m_n[2], tetra.m_n[3]);
  }
  body.initializeDmInverse();
}

}  // namespace lazyccd::test
