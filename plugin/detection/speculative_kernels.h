// Prospects of contacts, eight at a time. Compiled once for each instruction set (plugin/isa); the
// results are those of make_row() and prospect_of(), to the bit.
#pragma once

#include <cstdint>

#include "lazyccd/contact.h"

namespace lazyccd::bullet {

// Of Motion, whose members these are, and Options.
template <class Scalar>
struct ProspectMotion {
  const Scalar *start, *end;
  const double *inverse_mass, *reach;
  std::int32_t soft_count;
  double recovery;
};

struct alignas(64) ProspectLanes {
  static constexpr int count = 8;
  double thickness[count];    // metres: given, that of the surfaces; then the contact's own
  double gap_squared[count];  // m^2: between the points in contact, where the step begins
  double gap_kept[count];     // m^2: of that gap and the one at the end, the dot product
  // As Prospect has them; true: not zero. The response is without dynamic rigid bodies.
  double move_squared[count], need[count], response[count];
  std::int64_t gives_way[count], may_open[count];
};

struct ProspectKernels {
  const char* name;
  void (*of_float)(const ProspectMotion<float>& motion, const Contact* contacts, int count,
                   ProspectLanes& lanes);
  void (*of_double)(const ProspectMotion<double>& motion, const Contact* contacts, int count,
                    ProspectLanes& lanes);

  // Of as many contacts as there are lanes at most.
  void find(const ProspectMotion<float>& motion, const Contact* contacts, int count,
            ProspectLanes& lanes) const {
    of_float(motion, contacts, count, lanes);
  }
  void find(const ProspectMotion<double>& motion, const Contact* contacts, int count,
            ProspectLanes& lanes) const {
    of_double(motion, contacts, count, lanes);
  }
};

// As of the sweeps.
const ProspectKernels* best_prospect_kernels();
const ProspectKernels* prospect_kernels(const char* name);

}  // namespace lazyccd::bullet
