// Estimates the rows of near contacts, eight at a time. Compiled once for each instruction set
// (plugin/isa). The results are the same as from make_row() and estimate_row(), to the bit.
#pragma once

#include <cstdint>

#include "lazyccd/contact.h"

namespace lazyccd::bullet {

/// Arrays and sizes of Motion, and corrected_share() of the step.
template <class Scalar>
struct RowEstimateInput {
  const Scalar *start, *end;
  const double *inverse_mass, *shortest_edge;
  std::int32_t soft_count;
  double corrected_share;
};

/// Input and output of the kernels, by contact.
struct alignas(64) RowEstimateLanes {
  static constexpr int count = 8;
  /// Metres; in: thickness of the surfaces; out: the contact's own thickness.
  double thickness[count];
  /// m^2: squared distance between the contact points at the start of the step
  double gap_squared[count];
  /// m^2: dot product of the gap vectors at the start and at the end of the step
  double gap_dot[count];
  /// As in RowEstimate; nonzero means true. The values leave out the share of dynamic rigid
  /// bodies.
  double move_squared[count], need[count], normal_mass[count];
  std::int64_t can_act[count], may_need_split[count];
};

struct RowEstimateKernels {
  const char* name;
  void (*of_float)(const RowEstimateInput<float>& motion, const Contact* contacts, int count,
                   RowEstimateLanes& lanes);
  void (*of_double)(const RowEstimateInput<double>& motion, const Contact* contacts, int count,
                    RowEstimateLanes& lanes);

  /// Evaluates `count` contacts, at most RowEstimateLanes::count.
  void find(const RowEstimateInput<float>& motion, const Contact* contacts, int count,
            RowEstimateLanes& lanes) const {
    of_float(motion, contacts, count, lanes);
  }
  void find(const RowEstimateInput<double>& motion, const Contact* contacts, int count,
            RowEstimateLanes& lanes) const {
    of_double(motion, contacts, count, lanes);
  }
};

/// Return the best kernels that this processor runs, or the kernels of the named instruction set
/// ("baseline", "avx2", "avx512"); null if the processor lacks it.
const RowEstimateKernels* best_row_estimate_kernels();
const RowEstimateKernels* row_estimate_kernels(const char* name);

}  // namespace lazyccd::bullet
