// Solves the links of a soft body, eight (float) or four (double) at a time.
// btSoftBody::PSolve_Links() (Bullet 3.24) solves them one after the other. Compiled once for each
// instruction set (plugin/isa). The results are Bullet's, to the bit, if Bullet is built without
// fused multiply-adds.
#pragma once

#include <cstdint>

namespace lazyccd::bullet {

template <class Scalar>
struct alignas(4 * sizeof(Scalar)) LinkedNode {
  Scalar x[4];  ///< metres; the fourth value has no meaning
};

/// Links that have no node in common. A missing link is replaced by a link of zero inverse mass
/// from a dummy node to itself; no other group uses that node.
template <class Scalar>
struct alignas(64) LinkGroup {
  static constexpr int links = 32 / sizeof(Scalar);
  Scalar c0[links], c1[links];    ///< as in btSoftBody::Link; c0 > 0
  Scalar inverse_mass[2][links];  ///< 1/kg, by end
  std::uint32_t node[2][links];   ///< by end: offset in bytes from the first node
};

/// Several passes over all groups, in order. A pass begins when the pass before it has done `skew`
/// groups, so that the processor always has several groups that do not depend on each other. `skew`
/// is at least the span from the first group that moves a node to the last one (LinkBatches::skew).
template <class Scalar>
struct LinkPasses {
  const LinkGroup<Scalar>* groups;
  int count, skew, passes;
  LinkedNode<Scalar>* nodes;
  std::uint32_t own_bytes;  ///< size of the body's nodes; the dummy nodes of missing links follow
};

struct LinkKernels {
  const char* name;
  void (*of_float)(const LinkPasses<float>& passes);
  void (*of_double)(const LinkPasses<double>& passes);

  void solve(const LinkPasses<float>& passes) const { of_float(passes); }
  void solve(const LinkPasses<double>& passes) const { of_double(passes); }
};

/// Return the best kernels that this processor runs, or the kernels of the named instruction set.
/// Null on other processors than x86-64: there compilers use fused multiply-adds by default, so
/// that Bullet's results may differ.
const LinkKernels* best_link_kernels();
const LinkKernels* link_kernels(const char* name);

}  // namespace lazyccd::bullet
