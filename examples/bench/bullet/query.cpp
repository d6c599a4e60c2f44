#include "bench/bullet/query.h"

#include <algorithm>
#include <array>

#include "BulletSoftBody/btSoftBodyInternals.h"

#include "bench/cpu_clock.h"

namespace lazyccd::bench {
namespace {

constexpr double time_step = 1.0 / 240;  // s, as in ccd.cpp

struct Pair {
  btSoftBody::Node nodes[4];  // the vertex, then the vertices of the face
  btSoftBody::Face face;
};

void fill(Pair& pair, const QueryPoints& points) {
  const btScalar dt = btScalar(time_step);
  for (int i = 0; i < 4; ++i) {
    const auto &p = points[i], &q = points[i + 4];
    btSoftBody::Node& n = pair.nodes[i];
    n.m_x = btVector3(btScalar(p[0]), btScalar(p[1]), btScalar(p[2]));
    n.m_v = (btVector3(btScalar(q[0]), btScalar(q[1]), btScalar(q[2])) - n.m_x) / dt;
    n.m_q = n.m_x + dt * n.m_v;
  }
  btSoftBody::Face& f = pair.face;
  for (int i = 0; i < 3; ++i) f.m_n[i] = &pair.nodes[i + 1];
  const btSoftBody::Node &a = *f.m_n[0], &b = *f.m_n[1], &c = *f.m_n[2];
  f.m_n0 = (b.m_x - a.m_x).cross(c.m_x - a.m_x);
  f.m_n1 = (b.m_q - a.m_q).cross(c.m_q - a.m_q);
  f.m_vn = (b.m_v - a.m_v).cross(c.m_v - a.m_v) * dt * dt;
}

}  // namespace

BulletAnswers bullet_queries(Span<const QueryPoints> queries) {
  // Few enough that the structures stay in a near cache; enough that reading the clock costs
  // little.
  constexpr std::size_t block = 128;
  static std::array<Pair, block> pairs;
  BulletAnswers answers;
  answers.hits.resize(queries.size());
  for (std::size_t first = 0; first < queries.size(); first += block) {
    const std::size_t count = std::min(block, queries.size() - first);
    for (std::size_t i = 0; i < count; ++i) fill(pairs[i], queries[first + i]);
    const double before = thread_nanoseconds();
    for (std::size_t i = 0; i < count; ++i) {
      btVector3 bary;
      answers.hits[first + i] =
          bernsteinCCD(&pairs[i].face, &pairs[i].nodes[0], btScalar(time_step), SAFE_EPSILON, bary);
    }
    answers.nanoseconds += thread_nanoseconds() - before;
  }
  return answers;
}

}  // namespace lazyccd::bench
