// Kernels of the link solver (links/link_kernels.h), compiled once for each instruction set.
#include "links/link_kernels.h"

// There is no AVX-512 version: the code that compilers make for it is slower than that for AVX2.
#if !defined(__AVX512F__)

#include <limits>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "simd/vector.h"

namespace lazyccd::bullet {
namespace LAZYCCD_ISA {
namespace {

using namespace lazyccd::LAZYCCD_ISA;

template <class Scalar>
LAZYCCD_INLINE Scalar* at(LinkedNode<Scalar>* nodes, std::uint32_t offset) {
  return reinterpret_cast<Scalar*>(reinterpret_cast<char*>(nodes) + offset);
}

// Solves the links of a group one by one, as Bullet's PSolve_Links(). Skips missing links: they
// share a node, so each would have to wait for the one before.
template <class Scalar>
void solve_each(const LinkGroup<Scalar>& group, const LinkPasses<Scalar>& all) {
  for (int i = 0; i < group.links; ++i) {
    if (group.node[0][i] >= all.own_bytes) continue;
    Scalar* const a = at(all.nodes, group.node[0][i]);
    Scalar* const b = at(all.nodes, group.node[1][i]);
    const Scalar del[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const Scalar length = del[0] * del[0] + del[1] * del[1] + del[2] * del[2];
    const Scalar sum = group.c1[i] + length;
    if (!(sum > std::numeric_limits<Scalar>::epsilon())) continue;
    const Scalar k = (group.c1[i] - length) / (group.c0[i] * sum);
    const Scalar factor_a = k * group.inverse_mass[0][i], factor_b = k * group.inverse_mass[1][i];
    for (int j = 0; j < 3; ++j) a[j] -= del[j] * factor_a;
    for (int j = 0; j < 3; ++j) b[j] += del[j] * factor_b;
  }
}

#if defined(__AVX2__)

// A register of nodes. Of floats it holds the node of one link and that of the fourth link after
// it; of doubles one node.
using FloatNode = SimdVector<float, 4>;
using Floats = SimdVector<float, 8>;
using Doubles = SimdVector<double, 4>;

LAZYCCD_INLINE const Floats& load(const float* p) { return *reinterpret_cast<const Floats*>(p); }
LAZYCCD_INLINE const Doubles& load(const double* p) { return *reinterpret_cast<const Doubles*>(p); }

LAZYCCD_INLINE Floats gather(LinkedNode<float>* nodes, const std::uint32_t* node) {
  const auto one = [&](int i) { return *reinterpret_cast<const __m128*>(at(nodes, node[i])); };
  return reinterpret_cast<Floats>(_mm256_insertf128_ps(_mm256_castps128_ps256(one(0)), one(4), 1));
}
LAZYCCD_INLINE Doubles gather(LinkedNode<double>* nodes, const std::uint32_t* node) {
  return load(at(nodes, node[0]));
}

LAZYCCD_INLINE void scatter(const Floats& x, const std::uint32_t* node, LinkedNode<float>* nodes) {
  const auto one = [&](int i) -> FloatNode& {
    return *reinterpret_cast<FloatNode*>(at(nodes, node[i]));
  };
  one(0) = shuffle<0, 1, 2, 3>(x, x);
  one(4) = shuffle<4, 5, 6, 7>(x, x);
}
LAZYCCD_INLINE void scatter(const Doubles& x, const std::uint32_t* node,
                            LinkedNode<double>* nodes) {
  *reinterpret_cast<Doubles*>(at(nodes, node[0])) = x;
}

// From one number per link: repeats that of link k (of floats, also that of link k + 4) over the
// lanes of its node.
template <int k>
LAZYCCD_INLINE Floats broadcast(const Floats& x) {
  return shuffle<k, k, k, k, k + 4, k + 4, k + 4, k + 4>(x, x);
}
template <int k>
LAZYCCD_INLINE Doubles broadcast(const Doubles& x) {
  return shuffle<k, k, k, k>(x, x);
}

// Transposes nodes into coordinates: `x` holds the x of each link, and so on.
template <class Lanes>
struct Coordinates {
  Lanes x, y, z;
};
LAZYCCD_INLINE Coordinates<Floats> coordinates(const Floats& a, const Floats& b, const Floats& c,
                                               const Floats& d) {
  const Floats ab = shuffle<0, 8, 1, 9, 4, 12, 5, 13>(a, b),
               cd = shuffle<0, 8, 1, 9, 4, 12, 5, 13>(c, d),
               ab_z = shuffle<2, 10, 3, 11, 6, 14, 7, 15>(a, b),
               cd_z = shuffle<2, 10, 3, 11, 6, 14, 7, 15>(c, d);
  return {shuffle<0, 1, 8, 9, 4, 5, 12, 13>(ab, cd), shuffle<2, 3, 10, 11, 6, 7, 14, 15>(ab, cd),
          shuffle<0, 1, 8, 9, 4, 5, 12, 13>(ab_z, cd_z)};
}
LAZYCCD_INLINE Coordinates<Doubles> coordinates(const Doubles& a, const Doubles& b,
                                                const Doubles& c, const Doubles& d) {
  const Doubles ab_xz = shuffle<0, 4, 2, 6>(a, b), cd_xz = shuffle<0, 4, 2, 6>(c, d),
                ab_y = shuffle<1, 5, 3, 7>(a, b), cd_y = shuffle<1, 5, 3, 7>(c, d);
  return {shuffle<0, 1, 4, 5>(ab_xz, cd_xz), shuffle<0, 1, 4, 5>(ab_y, cd_y),
          shuffle<2, 3, 6, 7>(ab_xz, cd_xz)};
}

// Whether every lane is above the limit. False if a lane is NaN.
LAZYCCD_INLINE bool all_above(const Floats& x, float limit) {
  return _mm256_movemask_ps(
             _mm256_cmp_ps(reinterpret_cast<__m256>(x), _mm256_set1_ps(limit), _CMP_GT_OQ)) == 0xff;
}
LAZYCCD_INLINE bool all_above(const Doubles& x, double limit) {
  return _mm256_movemask_pd(
             _mm256_cmp_pd(reinterpret_cast<__m256d>(x), _mm256_set1_pd(limit), _CMP_GT_OQ)) == 0xf;
}

template <class Scalar>
LAZYCCD_INLINE void solve_group(const LinkGroup<Scalar>& group, const LinkPasses<Scalar>& all) {
  LinkedNode<Scalar>* const nodes = all.nodes;
  const std::uint32_t* const a = group.node[0];
  const std::uint32_t* const b = group.node[1];
  const auto a0 = gather(nodes, a), a1 = gather(nodes, a + 1), a2 = gather(nodes, a + 2),
             a3 = gather(nodes, a + 3);
  const auto b0 = gather(nodes, b), b1 = gather(nodes, b + 1), b2 = gather(nodes, b + 2),
             b3 = gather(nodes, b + 3);
  const auto del0 = b0 - a0, del1 = b1 - a1, del2 = b2 - a2, del3 = b3 - a3;
  const auto del = coordinates(del0, del1, del2, del3);
  const auto length = del.x * del.x + del.y * del.y + del.z * del.z;
  const auto &c0 = load(group.c0), &c1 = load(group.c1);
  const auto sum = c1 + length;
  if (!all_above(sum, std::numeric_limits<Scalar>::epsilon())) return solve_each(group, all);
  const auto k = (c1 - length) / (c0 * sum);
  const auto factor_a = k * load(group.inverse_mass[0]), factor_b = k * load(group.inverse_mass[1]);
  scatter(a0 - del0 * broadcast<0>(factor_a), a, nodes);
  scatter(a1 - del1 * broadcast<1>(factor_a), a + 1, nodes);
  scatter(a2 - del2 * broadcast<2>(factor_a), a + 2, nodes);
  scatter(a3 - del3 * broadcast<3>(factor_a), a + 3, nodes);
  scatter(b0 + del0 * broadcast<0>(factor_b), b, nodes);
  scatter(b1 + del1 * broadcast<1>(factor_b), b + 1, nodes);
  scatter(b2 + del2 * broadcast<2>(factor_b), b + 2, nodes);
  scatter(b3 + del3 * broadcast<3>(factor_b), b + 3, nodes);
}

#else

template <class Scalar>
LAZYCCD_INLINE void solve_group(const LinkGroup<Scalar>& group, const LinkPasses<Scalar>& all) {
  solve_each(group, all);
}

#endif

// Runs all passes at once; each one follows `skew` groups behind the one before it. The innermost
// loop solves one group of every pass that is under way, earlier passes first.
template <class Scalar>
void solve(const LinkPasses<Scalar>& all) {
  const std::int64_t end = all.count + (all.passes - std::int64_t{1}) * all.skew;
  for (std::int64_t tick = 0; tick < end; ++tick) {
    std::int64_t pass = tick < all.count ? 0 : (tick - all.count) / all.skew + 1;
    for (std::int64_t group = tick - pass * all.skew; pass < all.passes && group >= 0; ++pass) {
      solve_group(all.groups[group], all);
      group -= all.skew;
    }
  }
}

#define LAZYCCD_NAME_OF(isa) LAZYCCD_TEXT_OF(isa)
#define LAZYCCD_TEXT_OF(isa) #isa

}  // namespace

extern const LinkKernels link_table;
const LinkKernels link_table = {LAZYCCD_NAME_OF(LAZYCCD_ISA), solve<float>, solve<double>};

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd::bullet

#endif
