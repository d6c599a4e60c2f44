// Where the bodies and vertices of a scene are after its indices have changed.
#pragma once

#include <cstdint>
#include <vector>

namespace lazyccd::bullet {

/// By old index: the new index, or -1 for what is gone.
struct Renumbering {
  std::vector<std::int32_t> bodies, vertices;
};

}  // namespace lazyccd::bullet
