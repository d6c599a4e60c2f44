#include "contact/contact_renumbering.h"

#include <algorithm>

#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

std::int32_t size_of(const IndexRange& range) { return range.last - range.first; }

bool are_of_one_mesh(const PrimitiveIndices::OfBody& a, const PrimitiveIndices::OfBody& b) {
  return size_of(a.vertices) == size_of(b.vertices) && size_of(a.faces) == size_of(b.faces) &&
         size_of(a.own_edges) == size_of(b.own_edges) && size_of(a.edges) == size_of(b.edges);
}

// The range of edges whose larger vertex lies in a range. They are sorted by it.
IndexRange edges_of(const IndexRange& vertices, Span<const Edge> edges) {
  const auto first_from = [&](std::int32_t vertex) {
    const auto is_before = [](const Edge& edge, std::int32_t v) { return edge[1] < v; };
    return static_cast<std::int32_t>(
        std::lower_bound(edges.begin(), edges.end(), vertex, is_before) - edges.begin());
  };
  return {first_from(vertices.first), first_from(vertices.last)};
}

}  // namespace

PrimitiveIndices::PrimitiveIndices(const StepTopology& topology, Span<const Edge> edges) {
  for (const StepTopology::BodyRecord& body : topology.bodies()) {
    const IndexRange vertices{body.first_vertex, body.first_vertex + body.vertex_count};
    bodies_.push_back({vertices, body.faces, body.edges, edges_of(vertices, edges)});
  }
  const Topology view = topology.topology();
  first_side_ = first_side_index(view);
  first_own_edge_ = first_edge_index(view);
}

std::int32_t PrimitiveIndices::edge_index(std::int32_t edge, const OfBody& own,
                                          const PrimitiveIndices& from,
                                          const OfBody& own_from) const {
  if (edge >= from.first_own_edge_)
    return first_own_edge_ + edge - from.first_own_edge_ + own.own_edges.first -
           own_from.own_edges.first;
  if (edge >= from.first_side_)
    return first_side_ + edge - from.first_side_ + 3 * (own.faces.first - own_from.faces.first);
  return edge + own.edges.first - own_from.edges.first;
}

ContactRenumbering::ContactRenumbering(const PrimitiveIndices& from, const PrimitiveIndices& to,
                                       const Renumbering& numbers,
                                       const std::vector<char>& is_changed)
    : from_(from), to_(to), new_index_(from.bodies().size(), -1) {
  LAZYCCD_ASSERT(is_changed.size() == to.bodies().size(), "each body has changed or not");
  std::int32_t last = -1;
  for (std::size_t old = 0; old < std::min(new_index_.size(), numbers.bodies.size()); ++old) {
    const std::int32_t body = numbers.bodies[old];
    if (body < 0 || is_changed[static_cast<std::size_t>(body)]) continue;
    const PrimitiveIndices::OfBody &before = old_primitives(static_cast<std::int32_t>(old)),
                                   &now = new_primitives(body);
    bool is_same = are_of_one_mesh(before, now);
    for (std::int32_t i = 0; is_same && i < size_of(now.vertices); ++i)
      is_same = numbers.vertices[before.vertices.first + i] == now.vertices.first + i;
    if (!is_same) continue;
    if (body < last) {  // the order of contacts is another one
      new_index_.assign(new_index_.size(), -1);
      return;
    }
    new_index_[old] = last = body;
  }
}

bool ContactRenumbering::renumber(Contact& contact) const {
  const std::int32_t a = (*this)[contact.body_a], b = (*this)[contact.body_b];
  if (a < 0 || b < 0) return false;
  const PrimitiveIndices::OfBody &old_a = old_primitives(contact.body_a),
                                 &old_b = old_primitives(contact.body_b),
                                 &new_a = new_primitives(a), &new_b = new_primitives(b);
  const int first_of_b = first_vertex_of_b(contact.kind);
  for (int i = 0; i < 4; ++i)
    contact.vertices[i] += i < first_of_b ? new_a.vertices.first - old_a.vertices.first
                                          : new_b.vertices.first - old_b.vertices.first;
  if (contact.kind == ContactKind::vertex_face) {
    contact.primitive_a += new_a.vertices.first - old_a.vertices.first;
    contact.primitive_b += new_b.faces.first - old_b.faces.first;
  } else {
    contact.primitive_a = to_.edge_index(contact.primitive_a, new_a, from_, old_a);
    contact.primitive_b = to_.edge_index(contact.primitive_b, new_b, from_, old_b);
  }
  contact.body_a = a;
  contact.body_b = b;
  return true;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
