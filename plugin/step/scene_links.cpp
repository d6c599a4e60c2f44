#include "step/scene_links.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <array>

#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

void read_links(const SoftScene& scene, const SoftScene::BodyRecord& record,
                std::vector<LinkSolver::Link>& links) {
  const btSoftBody& body = *record.body;
  ScratchVector<std::int32_t> vertex_of(static_cast<std::size_t>(body.m_nodes.size()), -1);
  for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v)
    vertex_of[static_cast<std::size_t>(scene.node_index(v))] = v;
  links.clear();
  for (int i = 0; i < body.m_links.size(); ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    const int a = index_of(body, link.m_n[0]), b = index_of(body, link.m_n[1]);
    if (link.m_bbending || a < 0 || b < 0) continue;
    const std::array<std::int32_t, 2> vertices = {vertex_of[static_cast<std::size_t>(a)],
                                                  vertex_of[static_cast<std::size_t>(b)]};
    if (vertices[0] >= 0 && vertices[1] >= 0)
      links.push_back({vertices, static_cast<double>(link.m_rl)});
  }
}

}  // namespace

Span<const LinkSolver::Link> SceneLinks::of(const SoftScene& scene, std::int32_t body) {
  is_read_.resize(scene.bodies().size(), 0);
  links_.resize(std::max(links_.size(), is_read_.size()));
  const auto index = static_cast<std::size_t>(body);
  if (!is_read_[index]) read_links(scene, scene.bodies()[index], links_[index]);
  is_read_[index] = 1;
  return links_[index];
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
