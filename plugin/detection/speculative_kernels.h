// Prospects of contacts, eight at a time. Compiled once for each instruction set (plugin/isa); the
// results are those of make_row() and speculative_contact_of(), to the bit.
#pragma once

#include <cstdint>

#include "lazyccd/contact.h"

namespace lazyccd::bullet {

// Of Motion, whose members these are, and SolverOptions.
template <class Scalar>
struct SpeculativeMotion {
  const Scalar *start, *end;
  const double *inverse_mass, *shortest_edge;
  std::int32_t soft_count;
  double position_correction;
};

struct alignas(64) SpeculativeLanes {
  static constexpr int count = 8;
  double thickness[count];    // metres: given, that of the surfaces; then the contact's own
  double gap_squared[count];  // m^2: between the points in contact, where the step begins
  double gap_dot[count];     // m^2: of that gap and the one at the end, the dot product
  // As SpeculativeContact has them; true: not zero. The response is without dynamic rigid bodies.
  double move_squared[count], need[count], normal_mass[count];
  std::int64_t is_movable[count], may_open[count];
};

struct SpeculativeKernels {
  const char* name;
  void (*of_float)(const SpeculativeMotion<float>& motion, const Contact* contacts, int count,
                   SpeculativeLanes& lanes);
  void (*of_double)(const SpeculativeMotion<double>& motion, const Contact* contacts, int count,
                    SpeculativeLanes& lanes);

  // Of as many contacts as there are lanes at most.
  void find(const SpeculativeMotion<float>& motion, const Contact* contacts, int count,
            SpeculativeLanes& lanes) const {
    of_float(motion, contacts, count, lanes);
  }
  void find(const SpeculativeMotion<double>& motion, const Contact* contacts, int count,
            SpeculativeLanes& lanes) const {
    of_double(motion, contacts, count, lanes);
  }
};

// As of the sweeps.
const SpeculativeKernels* best_speculative_kernels();
const SpeculativeKernels* speculative_kernels(const char* name);

}  // namespace lazyccd::bullet
