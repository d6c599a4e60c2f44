#include "links/link_kernels.h"

// For AVX-512 the compiler's code is slower than that for AVX2.
#if !defined(__AVX512F__)

#include <limits>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#ifndef LAZYCCD_ISA
#error "compile with -DLAZYCCD_ISA=<name>"
#endif
#define LAZYCCD_INLINE inline __attribute__((always_inline))

namespace lazyccd::bullet {
namespace LAZYCCD_ISA {
namespace {

template <class Scalar>
LAZYCCD_INLINE Scalar* at(LinkedNode<Scalar>* nodes, std::uint32_t offset) {
  return reinterpret_cast<Scalar*>(reinterpret_cast<char*>(nodes) + offset);
}

// As PSolve_Links(). One missing link would wait for the other: they are left out.
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
    const Scalar of_a = k * group.inverse_mass[0][i], of_b = k * group.inverse_mass[1][i];
    for (int j = 0; j < 3; ++j) a[j] -= del[j] * of_a;
    for (int j = 0; j < 3; ++j) b[j] += del[j] * of_b;
  }
}

#if defined(__AVX2__)

#define LAZYCCD_SHUFFLED __builtin_shufflevector

// Registers of nodes: of floats, that of one link and that of the fourth one after it.
typedef float FloatNode __attribute__((vector_size(16)));
typedef float Floats __attribute__((vector_size(32)));
typedef double Doubles __attribute__((vector_size(32)));

LAZYCCD_INLINE const Floats& load(const float* p) { return *reinterpret_cast<const Floats*>(p); }
LAZYCCD_INLINE const Doubles& load(const double* p) { return *reinterpret_cast<const Doubles*>(p); }

LAZYCCD_INLINE Floats gathered(LinkedNode<float>* nodes, const std::uint32_t* node) {
  const auto one = [&](int i) { return *reinterpret_cast<const __m128*>(at(nodes, node[i])); };
  return reinterpret_cast<Floats>(_mm256_insertf128_ps(_mm256_castps128_ps256(one(0)), one(4), 1));
}
LAZYCCD_INLINE Doubles gathered(LinkedNode<double>* nodes, const std::uint32_t* node) {
  return load(at(nodes, node[0]));
}

LAZYCCD_INLINE void scatter(const Floats& x, const std::uint32_t* node, LinkedNode<float>* nodes) {
  const auto one = [&](int i) -> FloatNode& {
    return *reinterpret_cast<FloatNode*>(at(nodes, node[i]));
  };
  one(0) = LAZYCCD_SHUFFLED(x, x, 0, 1, 2, 3);
  one(4) = LAZYCCD_SHUFFLED(x, x, 4, 5, 6, 7);
}
LAZYCCD_INLINE void scatter(const Doubles& x, const std::uint32_t* node,
                            LinkedNode<double>* nodes) {
  *reinterpret_cast<Doubles*>(at(nodes, node[0])) = x;
}

// Of a number for each link, that of the k-th one in the places of its node.
template <int k>
LAZYCCD_INLINE Floats each(const Floats& x) {
  return LAZYCCD_SHUFFLED(x, x, k, k, k, k, k + 4, k + 4, k + 4, k + 4);
}
template <int k>
LAZYCCD_INLINE Doubles each(const Doubles& x) {
  return LAZYCCD_SHUFFLED(x, x, k, k, k, k);
}

// From each node's x, y and z: in `x`, that of each link, and so on.
template <class Lanes>
struct Coordinates {
  Lanes x, y, z;
};
LAZYCCD_INLINE Coordinates<Floats> coordinates(const Floats& a, const Floats& b, const Floats& c,
                                               const Floats& d) {
  const Floats ab = LAZYCCD_SHUFFLED(a, b, 0, 8, 1, 9, 4, 12, 5, 13),
               cd = LAZYCCD_SHUFFLED(c, d, 0, 8, 1, 9, 4, 12, 5, 13),
               ab_z = LAZYCCD_SHUFFLED(a, b, 2, 10, 3, 11, 6, 14, 7, 15),
               cd_z = LAZYCCD_SHUFFLED(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
  return {LAZYCCD_SHUFFLED(ab, cd, 0, 1, 8, 9, 4, 5, 12, 13),
          LAZYCCD_SHUFFLED(ab, cd, 2, 3, 10, 11, 6, 7, 14, 15),
          LAZYCCD_SHUFFLED(ab_z, cd_z, 0, 1, 8, 9, 4, 5, 12, 13)};
}
LAZYCCD_INLINE Coordinates<Doubles> coordinates(const Doubles& a, const Doubles& b,
                                                const Doubles& c, const Doubles& d) {
  const Doubles ab_xz = LAZYCCD_SHUFFLED(a, b, 0, 4, 2, 6),
                cd_xz = LAZYCCD_SHUFFLED(c, d, 0, 4, 2, 6),
                ab_y = LAZYCCD_SHUFFLED(a, b, 1, 5, 3, 7),
                cd_y = LAZYCCD_SHUFFLED(c, d, 1, 5, 3, 7);
  return {LAZYCCD_SHUFFLED(ab_xz, cd_xz, 0, 1, 4, 5), LAZYCCD_SHUFFLED(ab_y, cd_y, 0, 1, 4, 5),
          LAZYCCD_SHUFFLED(ab_xz, cd_xz, 2, 3, 6, 7)};
}

LAZYCCD_INLINE bool all_above(const Floats& x, float least) {
  return _mm256_movemask_ps(
             _mm256_cmp_ps(reinterpret_cast<__m256>(x), _mm256_set1_ps(least), _CMP_GT_OQ)) == 0xff;
}
LAZYCCD_INLINE bool all_above(const Doubles& x, double least) {
  return _mm256_movemask_pd(
             _mm256_cmp_pd(reinterpret_cast<__m256d>(x), _mm256_set1_pd(least), _CMP_GT_OQ)) == 0xf;
}

template <class Scalar>
LAZYCCD_INLINE void solve_group(const LinkGroup<Scalar>& group, const LinkPasses<Scalar>& all) {
  LinkedNode<Scalar>* const nodes = all.nodes;
  const std::uint32_t* const a = group.node[0];
  const std::uint32_t* const b = group.node[1];
  const auto a0 = gathered(nodes, a), a1 = gathered(nodes, a + 1), a2 = gathered(nodes, a + 2),
             a3 = gathered(nodes, a + 3);
  const auto b0 = gathered(nodes, b), b1 = gathered(nodes, b + 1), b2 = gathered(nodes, b + 2),
             b3 = gathered(nodes, b + 3);
  const auto del0 = b0 - a0, del1 = b1 - a1, del2 = b2 - a2, del3 = b3 - a3;
  const auto del = coordinates(del0, del1, del2, del3);
  const auto length = del.x * del.x + del.y * del.y + del.z * del.z;
  const auto &c0 = load(group.c0), &c1 = load(group.c1);
  const auto sum = c1 + length;
  if (!all_above(sum, std::numeric_limits<Scalar>::epsilon())) return solve_each(group, all);
  const auto k = (c1 - length) / (c0 * sum);
  const auto of_a = k * load(group.inverse_mass[0]), of_b = k * load(group.inverse_mass[1]);
  scatter(a0 - del0 * each<0>(of_a), a, nodes);
  scatter(a1 - del1 * each<1>(of_a), a + 1, nodes);
  scatter(a2 - del2 * each<2>(of_a), a + 2, nodes);
  scatter(a3 - del3 * each<3>(of_a), a + 3, nodes);
  scatter(b0 + del0 * each<0>(of_b), b, nodes);
  scatter(b1 + del1 * each<1>(of_b), b + 1, nodes);
  scatter(b2 + del2 * each<2>(of_b), b + 2, nodes);
  scatter(b3 + del3 * each<3>(of_b), b + 3, nodes);
}

#else

template <class Scalar>
LAZYCCD_INLINE void solve_group(const LinkGroup<Scalar>& group, const LinkPasses<Scalar>& all) {
  solve_each(group, all);
}

#endif

template <class Scalar>
void solve(const LinkPasses<Scalar>& all) {
  const std::int64_t end = all.count + (all.passes - std::int64_t{1}) * all.skew;
  for (std::int64_t time = 0; time < end; ++time) {
    std::int64_t pass = time < all.count ? 0 : (time - all.count) / all.skew + 1;
    for (std::int64_t group = time - pass * all.skew; pass < all.passes && group >= 0; ++pass) {
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
