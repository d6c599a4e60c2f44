#include "motion/parts_inside.h"

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void PartsInside::sort() {
  const auto sort = [](auto& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  sort(vertices);
  sort(edges);
  sort(faces);
}

bool PartsInside::contains(Span<const std::int32_t> soft, std::int32_t body) const {
  const auto has_vertex = [&](std::int32_t v) {
    return std::binary_search(vertices.begin(), vertices.end(),
                              std::array<std::int32_t, 2>{v, body});
  };
  if (std::any_of(soft.begin(), soft.end(), has_vertex)) return true;
  if (edges.empty() && faces.empty()) return false;
  for (std::size_t i = 0; i < soft.size(); ++i) {
    for (std::size_t k = i + 1; k < soft.size(); ++k) {
      const std::array<std::int32_t, 3> edge = {std::min(soft[i], soft[k]),
                                                std::max(soft[i], soft[k]), body};
      if (std::binary_search(edges.begin(), edges.end(), edge)) return true;
    }
  }
  if (soft.size() != 3 || faces.empty()) return false;
  std::array<std::int32_t, 4> face = {soft[0], soft[1], soft[2], body};
  std::sort(face.begin(), face.begin() + 3);
  return std::binary_search(faces.begin(), faces.end(), face);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
