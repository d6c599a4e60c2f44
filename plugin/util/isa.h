// The instruction sets that plugin/isa is compiled for, best first: "avx512", "avx2", "baseline".
//
// Each instruction set has a namespace of its name. LAZYCCD_ISA_TABLE(Kernels, table) declares the
// constant `table` of type Kernels in each of them, and the array table_by_isa of their addresses.
// LAZYCCD_ISA_TABLE_AVX2 leaves AVX-512 out.
#pragma once

#include <cstddef>
#include <cstring>

namespace lazyccd::bullet {

/// True if this processor runs the named instruction set.
inline bool runs_isa(const char* name) {
#if defined(LAZYCCD_ISA_X86)
  if (!std::strcmp(name, "avx512"))
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
  if (!std::strcmp(name, "avx2")) return __builtin_cpu_supports("avx2");
#endif
  return !std::strcmp(name, "baseline");
}

/// Returns the first of `kernels` (best first) that this processor runs, or the one with the given
/// name. Null if the processor lacks it.
template <class Kernels, std::size_t count>
const Kernels* first_that_runs(const Kernels* const (&kernels)[count], const char* name = nullptr) {
  for (const Kernels* const k : kernels)
    if ((!name || !std::strcmp(name, k->name)) && runs_isa(k->name)) return k;
  return nullptr;
}

}  // namespace lazyccd::bullet

#define LAZYCCD_ISA_DECLARE(isa, Kernels, table) \
  namespace isa {                                \
  extern const Kernels table;                    \
  }

#if defined(LAZYCCD_ISA_X86)
#define LAZYCCD_ISA_TABLE(Kernels, table)                                           \
  LAZYCCD_ISA_DECLARE(avx512, Kernels, table)                                       \
  LAZYCCD_ISA_DECLARE(avx2, Kernels, table)                                         \
  LAZYCCD_ISA_DECLARE(baseline, Kernels, table)                                     \
  static constexpr const Kernels* table##_by_isa[] = {&avx512::table, &avx2::table, \
                                                      &baseline::table};
#define LAZYCCD_ISA_TABLE_AVX2(Kernels, table)  \
  LAZYCCD_ISA_DECLARE(avx2, Kernels, table)     \
  LAZYCCD_ISA_DECLARE(baseline, Kernels, table) \
  static constexpr const Kernels* table##_by_isa[] = {&avx2::table, &baseline::table};
#else
#define LAZYCCD_ISA_TABLE(Kernels, table)       \
  LAZYCCD_ISA_DECLARE(baseline, Kernels, table) \
  static constexpr const Kernels* table##_by_isa[] = {&baseline::table};
#endif
