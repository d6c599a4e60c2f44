// Links of a soft body, as btSoftBody::PSolve_Links() (Bullet 3.24) solves them one after the
// other, eight (float) or four (double) at a time. Compiled once for each instruction set
// (plugin/isa); the results are Bullet's, to the bit, where Bullet is built without fused
// multiply-adds.
#pragma once

#include <cstdint>

namespace lazyccd::bullet {

template <class Scalar>
struct alignas(4 * sizeof(Scalar)) LinkedNode {
  Scalar x[4];  // metres; the fourth is of no matter
};

// Links that have no node in common. In place of a missing one there is one from a node to itself,
// of no mass, that no other group has.
template <class Scalar>
struct alignas(64) LinkGroup {
  static constexpr int links = 32 / sizeof(Scalar);
  Scalar c0[links], c1[links];    // as Link has them; c0 > 0
  Scalar inverse_mass[2][links];  // 1/kg, by end
  std::uint32_t node[2][links];   // by end: bytes from the first node
};

// Passes over all groups, in their order. Each begins when the one before it has done `skew`
// groups, so that the processor has several at hand that do not wait for each other. From the first
// group that moves a node to the last one there are at most that many.
template <class Scalar>
struct LinkPasses {
  const LinkGroup<Scalar>* groups;
  int count, skew, passes;
  LinkedNode<Scalar>* nodes;
  std::uint32_t own_bytes;  // of the body's nodes; behind them are those of missing links
};

struct LinkKernels {
  const char* name;
  void (*of_float)(const LinkPasses<float>& passes);
  void (*of_double)(const LinkPasses<double>& passes);

  void solve(const LinkPasses<float>& passes) const { of_float(passes); }
  void solve(const LinkPasses<double>& passes) const { of_double(passes); }
};

// The best of those that this processor runs; null elsewhere than on x86-64, where compilers take
// fused multiply-adds by themselves, so that Bullet's results may be others.
const LinkKernels* best_link_kernels();
const LinkKernels* link_kernels(const char* name);

}  // namespace lazyccd::bullet
