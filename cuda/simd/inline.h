// What the kernels need of the compiler beyond C++: forced inlining, prefetching, bit counts.
//
// LAZYCCD_PLAIN_CPP replaces all of it, and the vectors of simd/vector.h, by plain C++ that gives
// the same bits. It is set for compilers other than GCC and Clang; a build may set it for tests.
#pragma once

#if !defined(__GNUC__) && !defined(__clang__) && !defined(LAZYCCD_PLAIN_CPP)
#define LAZYCCD_PLAIN_CPP
#endif

#if defined(__GNUC__) || defined(__clang__)
#define LAZYCCD_INLINE inline __attribute__((always_inline))
#elif defined(_MSC_VER)
#define LAZYCCD_INLINE __forceinline
#else
#define LAZYCCD_INLINE inline
#endif

#if defined(LAZYCCD_PLAIN_CPP)
#define LAZYCCD_PREFETCH(address) static_cast<void>(address)
#else
#define LAZYCCD_PREFETCH(address) __builtin_prefetch(address)
#endif
