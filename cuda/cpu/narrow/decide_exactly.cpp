#include "cpu/narrow/decide_exactly.h"

#include "cpu/narrow/exact.h"

namespace lazyccd {
namespace {

template <ContactKind kind>
bool decide_kind(const MeshView& mesh, Candidate pair, const Positions& start, const Positions& end,
                 Contact& contact) {
  identify_contact<kind>(mesh, pair, contact);
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    const std::size_t v = static_cast<std::size_t>(contact.vertices[i]);
    q.start[i] = {start[v][0], start[v][1], start[v][2]};
    q.end[i] = {end[v][0], end[v][1], end[v][2]};
  }
  const Decision decision = decide_exactly(kind, q);
  if (decision.kind == Decision::miss) return false;
  contact.toi = static_cast<double>(decision.tick) * kTick;
  describe_contact<kind>(q, contact.toi, false, contact);
  return true;
}

}  // namespace

Decision decide_exactly(ContactKind kind, const QueryCoordinates& q) {
  QueryPoints points;
  for (int i = 0; i < 4; ++i) {
    points[i] = {q.start[i].x, q.start[i].y, q.start[i].z};
    points[4 + i] = {q.end[i].x, q.end[i].y, q.end[i].z};
  }
  const QueryResult result = decide_exact(kind, points);
  return {result.hit ? Decision::hit : Decision::miss, static_cast<std::int64_t>(result.toi / kTick)};
}

bool decide_exactly(ContactKind kind, const MeshView& mesh, Candidate pair, const Positions& start,
                    const Positions& end, Contact& contact) {
  return kind == ContactKind::vertex_face
             ? decide_kind<ContactKind::vertex_face>(mesh, pair, start, end, contact)
             : decide_kind<ContactKind::edge_edge>(mesh, pair, start, end, contact);
}

}  // namespace lazyccd
