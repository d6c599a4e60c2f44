// The programs lazyccd_link_costs and lazyccd_link_costs_double: measure the time of solving the
// links of a cloth, with btSoftBody::solveConstraints() and with LazyCCD's replacement
// (plugin/links/soft_constraints.h).
//
// The cloth falls from two pinned nodes. In each step both solvers solve the same state, one after
// the other, on one thread; the results must be equal to the bit. The table has microseconds, as
// medians over the steps. Exit code 1: the results differ.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "bench/machine.h"
#include "links/soft_constraints.h"
#include "scenes/meshes/cloth.h"

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
  for (const int pinned : {0, nodes - 1}) cloth->setMass(pinned, 0);
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

// Measures one size of cloth and prints a row. Returns false if the results differ.
bool compare(int nodes, int iterations) {
  btSoftBodyWorldInfo info;
  const std::unique_ptr<btSoftBody> with_bullet = make_cloth(info, nodes, iterations),
                                    with_lazyccd = make_cloth(info, nodes, iterations);
  btAlignedObjectArray<btSoftBody*> bodies;
  bodies.push_back(with_lazyccd.get());
  bullet::SoftConstraints constraints;
  const auto run_serially = [](std::size_t count, std::size_t, const auto& body) {
    body(0, count);
  };
  const auto time = [](const auto& solve) {
    const auto begin = std::chrono::steady_clock::now();
    solve();
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin)
        .count();
  };
  std::vector<double> times[2];
  for (int step = 0; step < steps; ++step) {
    with_bullet->predictMotion(dt);
    times[0].push_back(time([&] { with_bullet->solveConstraints(); }));
    with_lazyccd->predictMotion(dt);
    times[1].push_back(time([&] { constraints.solve(bodies, run_serially); }));
  }
  const double before = bench::median(times[0]), now = bench::median(times[1]);
  const bool same = are_same(*with_bullet, *with_lazyccd);
  std::printf("| %d x %d | %d | %d | %.1f | %.1f | %.2f |%s\n", nodes, nodes,
              with_bullet->m_links.size(), iterations, before, now, now / before,
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
