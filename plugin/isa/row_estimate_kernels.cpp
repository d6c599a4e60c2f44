// Kernels that estimate the rows of near contacts (detection/row_estimate_kernels.h),
// compiled once for each instruction set.
#include "detection/row_estimate_kernels.h"

#include "settings.h"
#include "simd/vector.h"

namespace lazyccd::bullet {
namespace LAZYCCD_ISA {
namespace {

using namespace lazyccd::LAZYCCD_ISA;

// Doubles in a register. Compilers split wider vectors, and then turn their selects into branches.
#if defined(__AVX512F__)
constexpr int width = 8;
#elif defined(__AVX2__)
constexpr int width = 4;
#else
constexpr int width = 2;
#endif

using Lanes = SimdVector<double, width>;
using Mask = SimdVector<std::int64_t, width>;

struct Vector {
  Lanes x, y, z;
};

LAZYCCD_INLINE void load(const double* from, Lanes& to) {
  to = *reinterpret_cast<const Lanes*>(from);
}
LAZYCCD_INLINE void store(const Lanes& x, double* to) { *reinterpret_cast<Lanes*>(to) = x; }
LAZYCCD_INLINE void store(const Mask& x, std::int64_t* to) { *reinterpret_cast<Mask*>(to) = x; }

// Adds in the same order as Vector3d::dot(), so that results are equal to the bit.
LAZYCCD_INLINE Lanes dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
// The same as std::max() and std::min(), also for NaN and zeros.
LAZYCCD_INLINE Lanes max(const Lanes& a, const Lanes& b) { return choose(a < b, b, a); }
LAZYCCD_INLINE Lanes min(const Lanes& a, const Lanes& b) { return choose(b < a, b, a); }

LAZYCCD_INLINE void add(const Lanes& weight, const Vector& x, Vector& sum) {
  sum.x += weight * x.x;
  sum.y += weight * x.y;
  sum.z += weight * x.z;
}

template <class Scalar>
LAZYCCD_INLINE void read(const Scalar* positions, const std::int32_t* vertices, Vector& to) {
  for (int i = 0; i < width; ++i) {
    const Scalar* const x = positions + 3 * static_cast<std::int64_t>(vertices[i]);
    to.x[i] = static_cast<double>(x[0]);
    to.y[i] = static_cast<double>(x[1]);
    to.z[i] = static_cast<double>(x[2]);
  }
}

// Evaluates the contacts first .. first + width - 1. Lanes past `count` repeat contact `first`.
template <class Scalar>
LAZYCCD_INLINE void evaluate_range(const RowEstimateInput<Scalar>& motion, const Contact* contacts,
                                   int first, int count, RowEstimateLanes& lanes) {
  const Lanes zero = {}, one = zero + 1;
  alignas(64) std::int32_t vertices[4][width];
  alignas(64) std::int64_t vertex_face[width], in_one_body[width];
  Lanes p, q;
  Vector normal;
  bool all_soft = true, any_in_one_body = false;
  for (int i = 0; i < width; ++i) {
    const Contact& contact = contacts[first + i < count ? first + i : first];
    for (int k = 0; k < 4; ++k) {
      vertices[k][i] = contact.vertices[k];
      all_soft &= contact.vertices[k] < motion.soft_count;
    }
    vertex_face[i] = contact.kind == ContactKind::vertex_face ? -1 : 0;
    in_one_body[i] = contact.body_a == contact.body_b ? -1 : 0;
    any_in_one_body |= contact.body_a == contact.body_b;
    p[i] = static_cast<double>(contact.u);
    q[i] = static_cast<double>(contact.v);
    normal.x[i] = static_cast<double>(contact.normal[0]);
    normal.y[i] = static_cast<double>(contact.normal[1]);
    normal.z[i] = static_cast<double>(contact.normal[2]);
  }
  const Mask is_vertex_face = *reinterpret_cast<const Mask*>(vertex_face);
  const Lanes weights[4] = {choose(is_vertex_face, one, one - p),
                            choose(is_vertex_face, -(one - p - q), p),
                            choose(is_vertex_face, -p, -(one - q)), -q};

  Vector start_sum = {}, end_sum = {}, move = {};
  Lanes start_gap = zero, compliance = zero, max_inverse_mass = zero, edge_length[4];
  for (int k = 0; k < 4; ++k) {
    const Lanes& weight = weights[k];
    Vector start, end;
    read(motion.start, vertices[k], start);
    read(motion.end, vertices[k], end);
    add(weight, start, start_sum);
    add(weight, end, end_sum);
    add(weight, {end.x - start.x, end.y - start.y, end.z - start.z}, move);
    start_gap += weight * dot(normal, start);
    Lanes inverse_mass = zero;
    for (int i = 0; i < width; ++i) {
      const std::int32_t v = vertices[k][i];
      if (all_soft || v < motion.soft_count) inverse_mass[i] = motion.inverse_mass[v];
    }
    compliance += weight * weight * inverse_mass;
    max_inverse_mass = max(max_inverse_mass, inverse_mass);
    if (!any_in_one_body) continue;
    for (int i = 0; i < width; ++i)
      edge_length[k][i] = in_one_body[i] ? motion.shortest_edge[vertices[k][i]] : 0;
    const Lanes abs_weight = choose(weight < 0, -weight, weight);
    edge_length[k] = choose(weight != 0, abs_weight * edge_length[k], zero);
  }

  Lanes thickness;
  load(lanes.thickness + first, thickness);
  if (any_in_one_body) {
    const Lanes edge_length_of_a = edge_length[0] + choose(is_vertex_face, zero, edge_length[1]);
    const Lanes edge_length_of_b =
        choose(is_vertex_face, edge_length[1], zero) + edge_length[2] + edge_length[3];
    const Lanes contact_thickness = min(
        thickness, settings::row::max_thickness_of_edge * min(edge_length_of_a, edge_length_of_b));
    thickness = choose(*reinterpret_cast<const Mask*>(in_one_body), contact_thickness, thickness);
  }

  const Lanes target_gap = min(thickness, max(zero, start_gap));
  const Lanes corrected_gap =
      target_gap + motion.corrected_share *
                       max(zero, settings::row::corrected_thickness * thickness - target_gap);
  const Mask can_act = compliance > 1e-6 * (compliance + compliance);
  const Lanes min_compliance = max_inverse_mass / settings::row::max_mass_ratio;
  store(thickness, lanes.thickness + first);
  store(dot(start_sum, start_sum), lanes.gap_squared + first);
  store(dot(start_sum, end_sum), lanes.gap_dot + first);
  store(dot(move, move), lanes.move_squared + first);
  store(target_gap - start_gap - dot(normal, move), lanes.need + first);
  // Immovable lanes divide by one: no division by zero, even if its result is not used.
  const Lanes divisor = choose(can_act, max(compliance, min_compliance), one);
  store(choose(can_act, one / divisor, zero), lanes.normal_mass + first);
  store(can_act, lanes.can_act + first);
  store(corrected_gap > target_gap, lanes.may_need_split + first);
}

template <class Scalar>
void evaluate(const RowEstimateInput<Scalar>& motion, const Contact* contacts, int count,
              RowEstimateLanes& lanes) {
  for (int first = 0; first < count; first += width)
    evaluate_range(motion, contacts, first, count, lanes);
}

#define LAZYCCD_NAME_OF(isa) LAZYCCD_TEXT_OF(isa)
#define LAZYCCD_TEXT_OF(isa) #isa

}  // namespace

extern const RowEstimateKernels row_estimate_table;
const RowEstimateKernels row_estimate_table = {LAZYCCD_NAME_OF(LAZYCCD_ISA), evaluate<float>,
                                               evaluate<double>};

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd::bullet
