// What the links of a cloth cost: btSoftBody::solveConstraints() against what LazyCCD has in its
// place (plugin/soft_constraints.h), a table.
//
// lazyccd_link_costs
// Microseconds, the median of the steps; in each the same cloth, falling from two held nodes, is
// solved in both ways, one after the other, with the same result to the bit. On one thread.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "bench/machine.h"
#include "scenes/meshes/cloth.h"
#include "links/soft_constraints.h"

namespace lazyccd::scenes {
namespace {

constexpr int steps = 100;
constexpr btScalar dt = btScalar(1) / 240;

std::unique_ptr<btSoftBody> make_cloth(btSoftBodyWorldInfo& info, int nodes, int iterations) {
  info.m_gravity = btVector3(0, -10, 0);
  std::mt19937 random(7);
  Sheet sheet{nodes, nodes, 1, 1};
  sheet.jitter = 0.02;
  std::unique_ptr<btSoftBody> cloth = make_sheet(info, sheet, random);
  for (const int held : {0, nodes - 1}) cloth->setMass(held, 0);
  cloth->m_cfg.piterations = iterations;
  return cloth;
}

bool are_same(const btSoftBody& a, const btSoftBody& b) {
  for (int i = 0; i < a.m_nodes.size(); ++i) {
    const btSoftBody::Node &x = a.m_nodes[i], &y = b.m_nodes[i];
    if (x.m_x != y.m_x || x.m_v != y.m_v) return false;
  }
  return true;
}

// False where the results differ.
bool compare(int nodes, int iterations) {
  btSoftBodyWorldInfo info;
  const std::unique_ptr<btSoftBody> bullets = make_cloth(info, nodes, iterations),
                                    ours = make_cloth(info, nodes, iterations);
  btAlignedObjectArray<btSoftBody*> bodies;
  bodies.push_back(ours.get());
  bullet::SoftConstraints constraints;
  const auto alone = [](std::size_t count, std::size_t, const auto& body) { body(0, count); };
  const auto time = [](const auto& solve) {
    const auto begin = std::chrono::steady_clock::now();
    solve();
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin)
        .count();
  };
  std::vector<double> times[2];
  for (int step = 0; step < steps; ++step) {
    bullets->predictMotion(dt);
    times[0].push_back(time([&] { bullets->solveConstraints(); }));
    ours->predictMotion(dt);
    times[1].push_back(time([&] { constraints.solve(bodies, alone); }));
  }
  const double before = bench::median(times[0]), now = bench::median(times[1]);
  const bool same = are_same(*bullets, *ours);
  std::printf("| %d x %d | %d | %d | %.1f | %.1f | %.2f |%s\n", nodes, nodes,
              bullets->m_links.size(), iterations, before, now, now / before,
              same ? "" : " NOT THE SAME");
  return same;
}

}  // namespace
}  // namespace lazyccd::scenes

int main() {
  std::printf("%s, %s\n\n| nodes | links | iterations | Bullet, us | LazyCCD, us | ratio |\n",
              lazyccd::bench::machine().c_str(),
              sizeof(btScalar) == sizeof(float) ? "float" : "double");
  std::printf("|---|---|---|---|---|---|\n");
  bool same = true;
  for (const int nodes : {16, 31, 50, 100})
    for (const int iterations : {1, 4, 10}) same &= lazyccd::scenes::compare(nodes, iterations);
  return same ? 0 : 1;
}
