// The kernels of the detector by name.
#pragma once

#include <cstring>

#include "host/kernels/leaf_kernels.h"

namespace lazyccd {

namespace plain {
extern const LeafKernels kernels;
}

namespace test {

/// As leaf_kernels(); "plain" are those of other compilers than GCC and Clang (simd/inline.h).
inline const LeafKernels* named_kernels(const char* name) {
  return std::strcmp(name, "plain") ? leaf_kernels(name) : &plain::kernels;
}

}  // namespace test
}  // namespace lazyccd
