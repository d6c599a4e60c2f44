// A hash of where all nodes are, to compare runs to the bit.
#pragma once

#include <cstdint>
#include <cstring>

#include "demo.h"

namespace lazyccd::web {

/// FNV-1a of the positions' bytes, 32 bits.
inline std::uint32_t hash_of_positions(const Demo& demo) {
  std::uint32_t hash = 2166136261u;
  for (const auto& body : demo.world().bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        unsigned char bytes[sizeof(btScalar)];
        std::memcpy(bytes, &body->m_nodes[i].m_x[k], sizeof bytes);
        for (const unsigned char byte : bytes) hash = (hash ^ byte) * 16777619u;
      }
    }
  }
  return hash;
}

}  // namespace lazyccd::web
