// Definitions on which the host and the device compiler must agree. All arithmetic of the project
// relies on IEEE 754 without contraction: the build passes -ffp-contract=off and -fmad=false, and
// never fast math.
#pragma once

#if defined(__CUDACC__)
#define LAZYCCD_HD __host__ __device__
#else
#define LAZYCCD_HD
#endif

/// On the device, keeps the compiler from unrolling the loop that follows: short kernels wait for
/// instructions more than for anything else.
#if defined(__CUDA_ARCH__)
#define LAZYCCD_ONE_COPY _Pragma("unroll 1")
#else
#define LAZYCCD_ONE_COPY
#endif

#if defined(__FAST_MATH__)
#error "LazyCCD's certified signs need IEEE arithmetic: do not compile with fast math"
#endif
