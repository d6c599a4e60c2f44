// The kernels of the adapter by name. As pgs_kernels(), link_kernels() and row_estimate_kernels();
// "plain" are those of other compilers than GCC and Clang (simd/inline.h).
#pragma once

#include <cstring>

#include "detection/row_estimate_kernels.h"
#include "links/link_kernels.h"
#include "solver/pgs_kernels.h"

namespace lazyccd::bullet {

namespace plain {
extern const PgsKernels pgs_table;
extern const LinkKernels link_table;
extern const RowEstimateKernels row_estimate_table;
}  // namespace plain

inline const PgsKernels* named_pgs_kernels(const char* name) {
  return std::strcmp(name, "plain") ? pgs_kernels(name) : &plain::pgs_table;
}
inline const LinkKernels* named_link_kernels(const char* name) {
  return std::strcmp(name, "plain") ? link_kernels(name) : &plain::link_table;
}
inline const RowEstimateKernels* named_row_estimate_kernels(const char* name) {
  return std::strcmp(name, "plain") ? row_estimate_kernels(name) : &plain::row_estimate_table;
}

}  // namespace lazyccd::bullet
