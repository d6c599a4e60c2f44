// Kernels of the contact solver (solver/pgs_kernels.h), compiled once for each instruction set. A
// register holds `width` rows of four floats. All widths give the same results, to the bit.
#include "solver/pgs_kernels.h"

#include <cstddef>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "simd/vector.h"

namespace lazyccd::bullet {
namespace LAZYCCD_ISA {
namespace {

using namespace lazyccd::LAZYCCD_ISA;

#if defined(__AVX512F__)
constexpr int width = 4;  // rows in a register
#elif defined(__AVX2__)
constexpr int width = 2;
#else
constexpr int width = 1;
#endif
constexpr int floats = 4 * width;

using Vector = SimdVector<float, 4>;
using Rows = SimdVector<float, floats>;

LAZYCCD_INLINE Rows load(const float* p) { return *reinterpret_cast<const Rows*>(p); }
LAZYCCD_INLINE void store(const Rows& a, float* p) { *reinterpret_cast<Rows*>(p) = a; }
LAZYCCD_INLINE Vector load4(const float* p) { return *reinterpret_cast<const Vector*>(p); }
LAZYCCD_INLINE Vector& at(Float4& x) { return *reinterpret_cast<Vector*>(x.x); }

// larger(a, b) is a > b ? a : b, and smaller(a, b) is a < b ? a : b, also for NaN and zeros.
// join(at) has at(i) as its row i.
#if defined(__AVX512F__)

LAZYCCD_INLINE Rows larger(const Rows& a, const Rows& b) {
  return reinterpret_cast<Rows>(
      _mm512_max_ps(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b)));
}
LAZYCCD_INLINE Rows smaller(const Rows& a, const Rows& b) {
  return reinterpret_cast<Rows>(
      _mm512_min_ps(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b)));
}
template <int a, int b, int c, int d>
LAZYCCD_INLINE Rows permute(const Rows& x) {
  return reinterpret_cast<Rows>(
      _mm512_permute_ps(reinterpret_cast<__m512>(x), a | b << 2 | c << 4 | d << 6));
}
LAZYCCD_INLINE Rows square_root(const Rows& x) {
  return reinterpret_cast<Rows>(_mm512_sqrt_ps(reinterpret_cast<__m512>(x)));
}
LAZYCCD_INLINE bool is_zero(const Rows& x) {
  const __m512 v = reinterpret_cast<__m512>(x);
  return _mm512_cmp_ps_mask(v, _mm512_setzero_ps(), _CMP_NEQ_UQ) == 0;
}
template <class RowAt>
LAZYCCD_INLINE Rows join(const RowAt& at) {
  const auto one = [&](int row) { return reinterpret_cast<__m128>(at(row)); };
  const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(one(0)), one(1), 1);
  const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(one(2)), one(3), 1);
  return reinterpret_cast<Rows>(_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1));
}
template <int row>
LAZYCCD_INLINE Vector row_of(const Rows& x) {
  return reinterpret_cast<Vector>(_mm512_extractf32x4_ps(reinterpret_cast<__m512>(x), row));
}

#elif defined(__AVX2__)

LAZYCCD_INLINE Rows larger(const Rows& a, const Rows& b) {
  return reinterpret_cast<Rows>(
      _mm256_max_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b)));
}
LAZYCCD_INLINE Rows smaller(const Rows& a, const Rows& b) {
  return reinterpret_cast<Rows>(
      _mm256_min_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b)));
}
template <int a, int b, int c, int d>
LAZYCCD_INLINE Rows permute(const Rows& x) {
  return reinterpret_cast<Rows>(
      _mm256_permute_ps(reinterpret_cast<__m256>(x), a | b << 2 | c << 4 | d << 6));
}
LAZYCCD_INLINE Rows square_root(const Rows& x) {
  return reinterpret_cast<Rows>(_mm256_sqrt_ps(reinterpret_cast<__m256>(x)));
}
LAZYCCD_INLINE bool is_zero(const Rows& x) {
  const __m256 v = reinterpret_cast<__m256>(x);
  return _mm256_movemask_ps(_mm256_cmp_ps(v, _mm256_setzero_ps(), _CMP_NEQ_UQ)) == 0;
}
template <class RowAt>
LAZYCCD_INLINE Rows join(const RowAt& at) {
  const auto one = [&](int row) { return reinterpret_cast<__m128>(at(row)); };
  return reinterpret_cast<Rows>(_mm256_insertf128_ps(_mm256_castps128_ps256(one(0)), one(1), 1));
}
template <int row>
LAZYCCD_INLINE Vector row_of(const Rows& x) {
  return reinterpret_cast<Vector>(_mm256_extractf128_ps(reinterpret_cast<__m256>(x), row));
}

#else

LAZYCCD_INLINE Rows larger(const Rows& a, const Rows& b) { return choose(a > b, a, b); }
LAZYCCD_INLINE Rows smaller(const Rows& a, const Rows& b) { return choose(a < b, a, b); }
template <int a, int b, int c, int d>
LAZYCCD_INLINE Rows permute(const Rows& x) {
  return Rows{x[a], x[b], x[c], x[d]};
}
LAZYCCD_INLINE bool is_zero(const Rows& x) {
  return x[0] == 0 && x[1] == 0 && x[2] == 0 && x[3] == 0;
}
template <class RowAt>
LAZYCCD_INLINE Rows join(const RowAt& at) {
  return at(0);
}
template <int row>
LAZYCCD_INLINE Vector row_of(const Rows& x) {
  return x;
}

#endif

// The displacements with these indices, which are 4 apart.
LAZYCCD_INLINE Rows gather(const Float4* from, const std::int32_t* index) {
  return join([&](int row) { return load4(from[index[4 * row]].x); });
}

// broadcast() repeats float k of each row in the whole row. sum() repeats the sum of each row in
// the whole row.
template <int k>
LAZYCCD_INLINE Rows broadcast(const Rows& x) {
  return permute<k, k, k, k>(x);
}
LAZYCCD_INLINE Rows sum(const Rows& x) {
  const Rows pairs = x + permute<1, 0, 3, 2>(x);
  return pairs + permute<2, 3, 0, 1>(pairs);
}

// The same four floats in each row.
LAZYCCD_INLINE Rows repeat(float a, float b, float c, float d) {
  Rows rows;
  for (int i = 0; i < floats; i += 4) {
    rows[i] = a;
    rows[i + 1] = b;
    rows[i + 2] = c;
    rows[i + 3] = d;
  }
  return rows;
}

template <int row>
LAZYCCD_INLINE void add_row(const Rows& x, const std::int32_t* index, Float4* to) {
  at(to[index[4 * row]]) += row_of<row>(x);
}

// Adds each row of `x` to one displacement. `index` is the index of the first row; those of the
// next rows are 4 apart.
LAZYCCD_INLINE void add(const Rows& x, const std::int32_t* index, Float4* to) {
  add_row<0>(x, index, to);
#if defined(__AVX2__)
  add_row<1>(x, index, to);
#endif
#if defined(__AVX512F__)
  add_row<2>(x, index, to);
  add_row<3>(x, index, to);
#endif
}

LAZYCCD_INLINE Vector cross(const Vector& a, const Vector& b) {
  return shuffle<1, 2, 0, 3>(a, a) * shuffle<2, 0, 1, 3>(b, b) -
         shuffle<2, 0, 1, 3>(a, a) * shuffle<1, 2, 0, 3>(b, b);
}

// By row of a batch: x, y, z and a zero.
constexpr int lanes = RowBatch::lanes;
static_assert(InactiveBatch::lanes == lanes, "they share functions");
struct alignas(64) RowVectors {
  Vector row[lanes];
};

// What rigid bodies move at the contacts. All rows of a batch are solved for the same motion of a
// body that they share, however many fit a register.
template <class Batch>
LAZYCCD_INLINE RowVectors displacement_of_bodies(const PgsProblem& problem, const Batch& batch) {
  RowVectors sum = {};
  for (std::int32_t i = batch.first_term; i < batch.last_term; ++i) {
    const RowRigidTerm& term = problem.rigid_terms[i];
    sum.row[term.lane] += term.weight * load4(problem.displacement[term.translation].x) +
                          cross(load4(problem.displacement[term.rotation].x), load4(term.arm));
  }
  return sum;
}

// Displacement of one side of each row relative to the other that all impulses together make.
// `of_bodies`: of displacement_of_bodies().
template <class Batch>
LAZYCCD_INLINE Rows relative_displacement(const PgsProblem& problem, const Batch& batch,
                                          const RowVectors& of_bodies, const std::int32_t* nodes,
                                          int first) {
  const std::int32_t* node = nodes + 4 * first;
  const Rows weight = load(batch.weight + 4 * first);
  const Float4* const from = problem.displacement;
  const Rows of_nodes =
      (broadcast<0>(weight) * gather(from, node) + broadcast<1>(weight) * gather(from, node + 1)) +
      (broadcast<2>(weight) * gather(from, node + 2) +
       broadcast<3>(weight) * gather(from, node + 3));
  if (batch.first_term == batch.last_term) return of_nodes;
  return of_nodes + join([&](int row) { return of_bodies.row[first + row]; });
}

// An impulse and an angular impulse on the centre of a body.
struct Wrench {
  Vector impulse, angular;
};

// Six columns times a wrench.
LAZYCCD_INLINE Vector sum_of_columns(const float (&columns)[6][4], const Wrench& by) {
  const Vector linear = (by.impulse[0] * load4(columns[0]) + by.impulse[1] * load4(columns[1])) +
                        by.impulse[2] * load4(columns[2]),
               angular = (by.angular[0] * load4(columns[3]) + by.angular[1] * load4(columns[4])) +
                         by.angular[2] * load4(columns[5]);
  return linear + angular;
}

// Adds the effect of a wrench on the body of a term to the displacements. If it is a link, all
// links of its multibody move.
LAZYCCD_INLINE void apply_to_body(const PgsProblem& problem, const RowRigidTerm& term,
                                  const Wrench& by) {
  Float4* const to = problem.displacement;
  const RowBody& body = problem.bodies[term.body];
  if (body.first_coupling != body.last_coupling) {
    for (std::int32_t i = body.first_coupling; i < body.last_coupling; ++i) {
      const RowCoupling& link = problem.couplings[i];
      at(to[link.translation]) += sum_of_columns(link.translation_by, by);
      at(to[link.rotation]) += sum_of_columns(link.rotation_by, by);
    }
  } else if (body.held >= 0) {
    const RowCoupling& own = problem.couplings[body.held];
    at(to[term.translation]) += sum_of_columns(own.translation_by, by);
    at(to[term.rotation]) += sum_of_columns(own.rotation_by, by);
  } else {
    at(to[term.translation]) += load4(body.inverse_mass) * by.impulse;
    at(to[term.rotation]) += (by.angular[0] * load4(body.inverse_inertia[0]) +
                              by.angular[1] * load4(body.inverse_inertia[1])) +
                             by.angular[2] * load4(body.inverse_inertia[2]);
  }
}

// Adds the effect of impulses on the rows of a batch to its rigid bodies. Terms of the same body
// follow each other, and their impulses act together.
LAZYCCD_INLINE void apply_to_bodies(const PgsProblem& problem, const RowBatch& batch,
                                    const RowVectors& impulses) {
  for (std::int32_t i = batch.first_term; i < batch.last_term;) {
    const RowRigidTerm& first = problem.rigid_terms[i];
    Wrench sum = {};
    do {
      const RowRigidTerm& term = problem.rigid_terms[i];
      const Vector impulse = impulses.row[term.lane];
      sum.impulse += term.weight * impulse;
      sum.angular += cross(load4(term.arm), impulse);
      ++i;
    } while (i < batch.last_term && problem.rigid_terms[i].translation == first.translation);
    apply_to_body(problem, first, sum);
  }
}

// Adds the effect of an impulse on each row to the displacements of nodes.
LAZYCCD_INLINE void apply_to_nodes(const PgsProblem& problem, const RowBatch& batch, int first,
                                   const Rows& impulse) {
  const std::int32_t* node = batch.scatter_node + 4 * first;
  const Rows mobility = load(batch.mobility + 4 * first);
  Float4* const to = problem.displacement;
  add(broadcast<0>(mobility) * impulse, node, to);
  add(broadcast<1>(mobility) * impulse, node + 1, to);
  add(broadcast<2>(mobility) * impulse, node + 2, to);
  add(broadcast<3>(mobility) * impulse, node + 3, to);
}

// Whether sliding_bound() changes the bound of a row.
LAZYCCD_INLINE bool changes_sliding_bound(const Rows& bound, const Rows& normal_impulse,
                                          bool fixes) {
  const Rows zero = repeat(0, 0, 0, 0), one = repeat(1, 1, 1, 1);
  const Rows open = choose(bound > zero, one, zero),
             loaded = choose(normal_impulse > zero, one, zero);
  const Rows changes = fixes ? larger(open, loaded) : open - loaded;
  return !is_zero(choose(bound >= zero, changes, zero));
}

// The next bound of the sliding friction of each row (RowBatch::tangent_move), from its impulses.
LAZYCCD_INLINE Rows sliding_bound(const Rows& bound, const Rows& fraction, const Rows& impulse,
                                  bool fixes) {
  const Rows zero = repeat(0, 0, 0, 0), tangent = repeat(1, 1, 1, 0) * impulse;
  const Rows min_size = repeat(0x1p-126f, 0x1p-126f, 0x1p-126f, 0x1p-126f);
  const Rows size = larger(square_root(sum(tangent * tangent)), min_size);
  const Rows loaded = choose(broadcast<3>(impulse) > zero, fraction, zero);
  const Rows open = fixes ? choose(bound > zero, -size, loaded) : loaded;
  return choose(bound >= zero, open, bound);
}

LAZYCCD_INLINE void prefetch(const RowBatch* batch) {
  const char* const first = reinterpret_cast<const char*>(batch);
  for (std::size_t i = 0; i < sizeof(RowBatch); i += 64) LAZYCCD_PREFETCH(first + i);
}

SweepChange sweep(const PgsProblem& problem, const std::int32_t* batches, int count,
                  const SweepMode& mode) {
  const Rows zero = repeat(0, 0, 0, 0), one = repeat(1, 1, 1, 1);
  const Rows tangent_mask = repeat(1, 1, 1, 0), normal_mask = repeat(0, 0, 0, 1);
  const Rows min_size = repeat(0x1p-126f, 0x1p-126f, 0x1p-126f, 0x1p-126f);
  // By register of a batch.
  Rows largest[lanes / width], change_size[lanes / width], restart_test[lanes / width];
  for (int i = 0; i < lanes / width; ++i) largest[i] = change_size[i] = restart_test[i] = zero;
  for (int b = 0; b < count; ++b) {
    RowBatch& batch = problem.batches[batches[b]];
    if (mode.next) prefetch(mode.next + b);
    const RowVectors of_bodies = displacement_of_bodies(problem, batch);
    RowVectors impulses = {};
    bool any_changes = false;
    for (int i = 0; i < lanes / width; ++i) {
      const int at = floats * i;
      const Rows normal = load(batch.normal + at), terms = load(batch.terms + at);
      const Rows last = load(batch.impulse + at);
      const Rows before = last + mode.extrapolation * (last - load(batch.last_impulse + at));
      store(last, batch.last_impulse + at);
      const Rows displacement =
          relative_displacement(problem, batch, of_bodies, batch.node, width * i);
      const Rows gap = sum(normal * displacement);
      const Rows normal_impulse =
          larger(broadcast<3>(before) + (broadcast<0>(terms) - gap) * broadcast<1>(terms), zero);
      // The change of the normal impulse also turns rigid bodies, which adds to the sliding. The
      // next sweep takes that into account.
      const Rows tangent_move = load(batch.tangent_move + at);
      const Rows sliding = tangent_move + displacement - gap * normal;
      const Rows tangent_impulse = tangent_mask * (before - broadcast<3>(terms) * sliding);
      const Rows size = larger(square_root(sum(tangent_impulse * tangent_impulse)), min_size);
      const Rows slip_bound = broadcast<3>(tangent_move);
      const Rows bound =
          larger(broadcast<2>(terms) * normal_impulse, larger(slip_bound * size, -slip_bound));
      const Rows scale = smaller(bound / size, one);
      const Rows now = tangent_impulse * scale + normal_mask * normal_impulse;
      const Rows change = now - before;
      store(now, batch.impulse + at);
      if (batch.slides && changes_sliding_bound(slip_bound, normal_impulse, mode.fixes_sliding)) {
        const Rows next = sliding_bound(slip_bound, broadcast<3>(load(batch.sliding + at)), now,
                                        mode.fixes_sliding);
        store(tangent_mask * tangent_move + normal_mask * next, batch.tangent_move + at);
      }
      if (is_zero(change)) continue;
      const Rows compliance = load(batch.compliance + at), made = change * compliance;
      largest[i] = larger(made * made, largest[i]);
      change_size[i] += change * made;
      restart_test[i] += made * (now - last);
      const Rows impulse = tangent_mask * change + broadcast<3>(change) * normal;
      apply_to_nodes(problem, batch, width * i, impulse);
      store(impulse, reinterpret_cast<float*>(impulses.row + width * i));
      any_changes = true;
    }
    if (any_changes) apply_to_bodies(problem, batch, impulses);
  }
  // Reduces in an order that is the same for all register widths.
  alignas(64) float per_row[3][4 * lanes];
  for (int i = 0; i < lanes / width; ++i) {
    store(largest[i], per_row[0] + floats * i);
    store(change_size[i], per_row[1] + floats * i);
    store(restart_test[i], per_row[2] + floats * i);
  }
  SweepChange total;
  for (int i = 0; i < 4 * lanes; ++i) {
    total.largest = per_row[0][i] > total.largest ? per_row[0][i] : total.largest;
    total.size += per_row[1][i];
    total.restart_test += per_row[2][i];
  }
  return total;
}

float max_violation(const PgsProblem& problem, int batches) {
  float largest = 0;
  for (int b = 0; b < batches; ++b) {
    const RowBatch& batch = problem.batches[b];
    const RowVectors of_bodies = displacement_of_bodies(problem, batch);
    for (int first = 0; first < lanes; first += width) {
      const Rows gap = sum(load(batch.normal + 4 * first) *
                           relative_displacement(problem, batch, of_bodies, batch.node, first));
      const Rows violation = load(batch.terms + 4 * first) - gap;
      for (int i = 0; i < floats; i += 4) largest = violation[i] > largest ? violation[i] : largest;
    }
  }
  return largest;
}

int find_violated(const PgsProblem& problem, const std::int32_t* node_of,
                  const InactiveBatch* inactive, int batches, std::int32_t* rows) {
  const Rows zero = repeat(0, 0, 0, 0);
  int found = 0;
  for (int b = 0; b < batches; ++b) {
    const InactiveBatch& batch = inactive[b];
    const RowVectors of_bodies = displacement_of_bodies(problem, batch);
    std::int32_t node[4 * lanes];
    for (int i = 0; i < 4 * lanes; ++i) node[i] = node_of[batch.vertex[i]];
    for (int first = 0; first < lanes; first += width) {
      const Rows normal = load(batch.normal + 4 * first);
      const Rows violation =
          broadcast<3>(normal) -
          sum(normal * relative_displacement(problem, batch, of_bodies, node, first));
      if (is_zero(larger(violation, zero))) continue;
      for (int i = 0; i < width; ++i)
        if (violation[4 * i] > 0) rows[found++] = lanes * b + first + i;
    }
  }
  return found;
}

void extrapolate(float factor, Float4* now, Float4* last, int count) {
  for (int i = 0; i < count; ++i) {
    const Vector x = at(now[i]);
    at(now[i]) = x + factor * (x - at(last[i]));
    at(last[i]) = x;
  }
}

void apply_impulses(const PgsProblem& problem, int index) {
  const RowBatch& batch = problem.batches[index];
  const Rows tangent_mask = repeat(1, 1, 1, 0);
  RowVectors impulses;
  for (int first = 0; first < lanes; first += width) {
    const Rows solved = load(batch.impulse + 4 * first);
    const Rows impulse =
        tangent_mask * solved + broadcast<3>(solved) * load(batch.normal + 4 * first);
    apply_to_nodes(problem, batch, first, impulse);
    store(impulse, reinterpret_cast<float*>(impulses.row + first));
  }
  apply_to_bodies(problem, batch, impulses);
}

#define LAZYCCD_NAME_OF(isa) LAZYCCD_TEXT_OF(isa)
#define LAZYCCD_TEXT_OF(isa) #isa

}  // namespace

extern const PgsKernels pgs_table;
const PgsKernels pgs_table = {
    LAZYCCD_NAME_OF(LAZYCCD_ISA), sweep, max_violation, find_violated, extrapolate, apply_impulses};

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd::bullet
