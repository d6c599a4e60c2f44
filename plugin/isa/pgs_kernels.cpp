#include "response/pgs_kernels.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#ifndef LAZYCCD_ISA
#error "compile with -DLAZYCCD_ISA=<name>"
#endif
#define LAZYCCD_INLINE inline __attribute__((always_inline))

namespace lazyccd::bullet {
namespace LAZYCCD_ISA {
namespace {

#if defined(__AVX512F__)
constexpr int width = 4;  // rows in a register
#elif defined(__AVX2__)
constexpr int width = 2;
#else
constexpr int width = 1;
#endif
constexpr int floats = 4 * width;

typedef float Vector __attribute__((vector_size(16)));
typedef float Rows __attribute__((vector_size(4 * floats)));

LAZYCCD_INLINE Rows load(const float* p) { return *reinterpret_cast<const Rows*>(p); }
LAZYCCD_INLINE void store(const Rows& a, float* p) { *reinterpret_cast<Rows*>(p) = a; }
LAZYCCD_INLINE Vector load4(const float* p) { return *reinterpret_cast<const Vector*>(p); }
LAZYCCD_INLINE Vector& at(Float4& x) { return *reinterpret_cast<Vector*>(x.x); }

// larger(): a > b ? a : b; smaller(): a < b ? a : b.
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
LAZYCCD_INLINE Rows permuted(const Rows& x) {
  return reinterpret_cast<Rows>(
      _mm512_permute_ps(reinterpret_cast<__m512>(x), a | b << 2 | c << 4 | d << 6));
}
LAZYCCD_INLINE Rows root(const Rows& x) {
  return reinterpret_cast<Rows>(_mm512_sqrt_ps(reinterpret_cast<__m512>(x)));
}
LAZYCCD_INLINE bool is_zero(const Rows& x) {
  const __m512 v = reinterpret_cast<__m512>(x);
  return _mm512_cmp_ps_mask(v, _mm512_setzero_ps(), _CMP_NEQ_UQ) == 0;
}
LAZYCCD_INLINE Rows gathered(const Float4* from, const std::int32_t* index) {
  const auto one = [&](int row) { return reinterpret_cast<__m128>(load4(from[index[4 * row]].x)); };
  const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(one(0)), one(1), 1);
  const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(one(2)), one(3), 1);
  return reinterpret_cast<Rows>(_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1));
}
template <int row>
LAZYCCD_INLINE Vector part_of(const Rows& x) {
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
LAZYCCD_INLINE Rows permuted(const Rows& x) {
  return reinterpret_cast<Rows>(
      _mm256_permute_ps(reinterpret_cast<__m256>(x), a | b << 2 | c << 4 | d << 6));
}
LAZYCCD_INLINE Rows root(const Rows& x) {
  return reinterpret_cast<Rows>(_mm256_sqrt_ps(reinterpret_cast<__m256>(x)));
}
LAZYCCD_INLINE bool is_zero(const Rows& x) {
  const __m256 v = reinterpret_cast<__m256>(x);
  return _mm256_movemask_ps(_mm256_cmp_ps(v, _mm256_setzero_ps(), _CMP_NEQ_UQ)) == 0;
}
LAZYCCD_INLINE Rows gathered(const Float4* from, const std::int32_t* index) {
  const auto one = [&](int row) { return reinterpret_cast<__m128>(load4(from[index[4 * row]].x)); };
  return reinterpret_cast<Rows>(_mm256_insertf128_ps(_mm256_castps128_ps256(one(0)), one(1), 1));
}
template <int row>
LAZYCCD_INLINE Vector part_of(const Rows& x) {
  return reinterpret_cast<Vector>(_mm256_extractf128_ps(reinterpret_cast<__m256>(x), row));
}

#else

LAZYCCD_INLINE Rows larger(const Rows& a, const Rows& b) { return a > b ? a : b; }
LAZYCCD_INLINE Rows smaller(const Rows& a, const Rows& b) { return a < b ? a : b; }
template <int a, int b, int c, int d>
LAZYCCD_INLINE Rows permuted(const Rows& x) {
  return Rows{x[a], x[b], x[c], x[d]};
}
LAZYCCD_INLINE Rows root(const Rows& x) {
  return Rows{__builtin_sqrtf(x[0]), __builtin_sqrtf(x[1]), __builtin_sqrtf(x[2]),
              __builtin_sqrtf(x[3])};
}
LAZYCCD_INLINE bool is_zero(const Rows& x) {
  return x[0] == 0 && x[1] == 0 && x[2] == 0 && x[3] == 0;
}
LAZYCCD_INLINE Rows gathered(const Float4* from, const std::int32_t* index) {
  return load4(from[*index].x);
}
template <int row>
LAZYCCD_INLINE Vector part_of(const Rows& x) {
  return x;
}

#endif

// In each row, one of its floats for all, and the sum of all.
template <int k>
LAZYCCD_INLINE Rows each(const Rows& x) {
  return permuted<k, k, k, k>(x);
}
LAZYCCD_INLINE Rows sum(const Rows& x) {
  const Rows pairs = x + permuted<1, 0, 3, 2>(x);
  return pairs + permuted<2, 3, 0, 1>(pairs);
}

LAZYCCD_INLINE Rows repeated(float a, float b, float c, float d) {
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
LAZYCCD_INLINE void add_part(const Rows& x, const std::int32_t* index, Float4* to) {
  at(to[index[4 * row]]) += part_of<row>(x);
}

// To one displacement of each row.
LAZYCCD_INLINE void add(const Rows& x, const std::int32_t* index, Float4* to) {
  add_part<0>(x, index, to);
#if defined(__AVX2__)
  add_part<1>(x, index, to);
#endif
#if defined(__AVX512F__)
  add_part<2>(x, index, to);
  add_part<3>(x, index, to);
#endif
}

LAZYCCD_INLINE Vector cross(const Vector& a, const Vector& b) {
  return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

// The parts of rigid bodies in the rows from `first` on that fill a register.
template <class Batch, class Each>
LAZYCCD_INLINE void for_each_part(const PgsProblem& problem, const Batch& batch, int first,
                                  const Each& each) {
  for (std::int32_t i = batch.first_part; i < batch.last_part; ++i) {
    const RowRigidTerm& part = problem.parts[i];
    if (part.row >= first && part.row < first + width) each(part, 4 * (part.row - first));
  }
}

// By all impulses.
template <class Batch>
LAZYCCD_INLINE Rows moved(const PgsProblem& problem, const Batch& batch,
                          const std::int32_t* nodes, int first) {
  const std::int32_t* node = nodes + 4 * first;
  const Rows weight = load(batch.weight + 4 * first);
  const Float4* const from = problem.displacement;
  Rows sum =
      (each<0>(weight) * gathered(from, node) + each<1>(weight) * gathered(from, node + 1)) +
      (each<2>(weight) * gathered(from, node + 2) + each<3>(weight) * gathered(from, node + 3));
  if (batch.first_part == batch.last_part) return sum;
  for_each_part(problem, batch, first, [&](const RowRigidTerm& part, int row) {
    const Vector of_body =
        part.weight * load4(from[part.translation].x) + cross(load4(from[part.rotation].x), load4(part.arm));
    for (int k = 0; k < 3; ++k) sum[row + k] += of_body[k];
  });
  return sum;
}

LAZYCCD_INLINE void push(const PgsProblem& problem, const RowBatch& batch, int first,
                         const Rows& impulse) {
  const std::int32_t* node = batch.pushed + 4 * first;
  const Rows mobility = load(batch.mobility + 4 * first);
  Float4* const to = problem.displacement;
  add(each<0>(mobility) * impulse, node, to);
  add(each<1>(mobility) * impulse, node + 1, to);
  add(each<2>(mobility) * impulse, node + 2, to);
  add(each<3>(mobility) * impulse, node + 3, to);
  if (batch.first_part == batch.last_part) return;
  for_each_part(problem, batch, first, [&](const RowRigidTerm& part, int row) {
    const Vector one = {impulse[row], impulse[row + 1], impulse[row + 2], 0};
    const RowBody& body = problem.bodies[part.body];
    at(to[part.translation]) += part.weight * (load4(body.inverse_mass) * one);
    const Vector about = cross(load4(part.arm), one);
    at(to[part.rotation]) +=
        (about[0] * load4(body.inverse_inertia[0]) + about[1] * load4(body.inverse_inertia[1])) +
        about[2] * load4(body.inverse_inertia[2]);
  });
}

SweepChange sweep(const PgsProblem& problem, const std::int32_t* batches, int count) {
  const Rows zero = repeated(0, 0, 0, 0), one = repeated(1, 1, 1, 1);
  const Rows across = repeated(1, 1, 1, 0), along = repeated(0, 0, 0, 1);
  const Rows least_size = repeated(0x1p-126f, 0x1p-126f, 0x1p-126f, 0x1p-126f);
  // By row of a batch.
  Rows largest[RowBatch::rows / width], energy[RowBatch::rows / width],
      restart_test[RowBatch::rows / width];
  for (int i = 0; i < RowBatch::rows / width; ++i) largest[i] = energy[i] = restart_test[i] = zero;
  for (int b = 0; b < count; ++b) {
    RowBatch& batch = problem.batches[batches[b]];
    for (int i = 0; i < RowBatch::rows / width; ++i) {
      const int at = floats * i;
      const Rows normal = load(batch.normal + at), before = load(batch.impulse + at),
                 terms = load(batch.terms + at);
      const Rows moved_by = moved(problem, batch, batch.node, width * i);
      const Rows gap = sum(normal * moved_by);
      const Rows now_along =
          larger(each<3>(before) + (each<0>(terms) - gap) * each<1>(terms), zero);
      // Of a rigid body, the impulse along the normal also turns, which the next sweep sees.
      const Rows sliding = load(batch.sliding + at) + moved_by - gap * normal;
      const Rows stopping = across * (before - each<3>(terms) * sliding);
      const Rows size = larger(root(sum(stopping * stopping)), least_size);
      const Rows part = smaller(each<2>(terms) * now_along / size, one);
      const Rows now = stopping * part + along * now_along;
      const Rows more = now - before;
      if (is_zero(more)) continue;
      const Rows compliance = load(batch.compliance + at), made = more * compliance;
      largest[i] = larger(made * made, largest[i]);
      energy[i] += more * made;
      restart_test[i] += made * (now - load(batch.last + at));
      store(now, batch.impulse + at);
      push(problem, batch, width * i, across * more + each<3>(more) * normal);
    }
  }
  // The same for all widths of a register.
  alignas(64) float of_rows[3][4 * RowBatch::rows];
  for (int i = 0; i < RowBatch::rows / width; ++i) {
    store(largest[i], of_rows[0] + floats * i);
    store(energy[i], of_rows[1] + floats * i);
    store(restart_test[i], of_rows[2] + floats * i);
  }
  SweepChange change;
  for (int i = 0; i < 4 * RowBatch::rows; ++i) {
    change.largest = of_rows[0][i] > change.largest ? of_rows[0][i] : change.largest;
    change.energy += of_rows[1][i];
    change.restart_test += of_rows[2][i];
  }
  return change;
}

float most_left(const PgsProblem& problem, int batches) {
  float most = 0;
  for (int b = 0; b < batches; ++b) {
    const RowBatch& batch = problem.batches[b];
    for (int first = 0; first < RowBatch::rows; first += width) {
      const Rows gap =
          sum(load(batch.normal + 4 * first) * moved(problem, batch, batch.node, first));
      const Rows left = load(batch.terms + 4 * first) - gap;
      for (int i = 0; i < floats; i += 4) most = left[i] > most ? left[i] : most;
    }
  }
  return most;
}

int lacking(const PgsProblem& problem, const std::int32_t* node_of, const InactiveBatch* waiting,
            int batches, std::int32_t* rows) {
  const Rows zero = repeated(0, 0, 0, 0);
  int found = 0;
  for (int b = 0; b < batches; ++b) {
    const InactiveBatch& batch = waiting[b];
    std::int32_t node[4 * InactiveBatch::rows];
    for (int i = 0; i < 4 * InactiveBatch::rows; ++i) node[i] = node_of[batch.vertex[i]];
    for (int first = 0; first < InactiveBatch::rows; first += width) {
      const Rows normal = load(batch.normal + 4 * first);
      const Rows left = each<3>(normal) - sum(normal * moved(problem, batch, node, first));
      if (is_zero(larger(left, zero))) continue;
      for (int i = 0; i < width; ++i)
        if (left[4 * i] > 0) rows[found++] = InactiveBatch::rows * b + first + i;
    }
  }
  return found;
}

void carry_on(float part, Float4* now, Float4* last, int count) {
  for (int i = 0; i < count; ++i) {
    const Vector x = at(now[i]);
    at(now[i]) = x + part * (x - at(last[i]));
    at(last[i]) = x;
  }
}

void push_all(const PgsProblem& problem, int index) {
  const RowBatch& batch = problem.batches[index];
  const Rows across = repeated(1, 1, 1, 0);
  for (int first = 0; first < RowBatch::rows; first += width) {
    const Rows impulse = load(batch.impulse + 4 * first);
    push(problem, batch, first,
         across * impulse + each<3>(impulse) * load(batch.normal + 4 * first));
  }
}

#define LAZYCCD_NAME_OF(isa) LAZYCCD_TEXT_OF(isa)
#define LAZYCCD_TEXT_OF(isa) #isa

}  // namespace

extern const PgsKernels pgs_table;
const PgsKernels pgs_table = {
    LAZYCCD_NAME_OF(LAZYCCD_ISA), sweep, most_left, lacking, carry_on, push_all};

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd::bullet
