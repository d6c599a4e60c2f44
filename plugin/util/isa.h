// The instruction sets that plugin/isa is compiled for, best first: "avx512", "avx2", "baseline".
#pragma once

#include <cstddef>
#include <cstring>

namespace lazyccd::bullet {

inline bool runs_isa(const char* name) {
#if defined(LAZYCCD_ISA_X86)
  if (!std::strcmp(name, "avx512"))
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
  if (!std::strcmp(name, "avx2")) return __builtin_cpu_supports("avx2");
#endif
  return !std::strcmp(name, "baseline");
}

// Of some, best first: the first that this processor runs, or the one of that name; null where the
// processor lacks it.
template <class Kernels, std::size_t count>
const Kernels* first_that_runs(const Kernels* const (&kernels)[count], const char* name = nullptr) {
  for (const Kernels* const k : kernels)
    if ((!name || !std::strcmp(name, k->name)) && runs_isa(k->name)) return k;
  return nullptr;
}

}  // namespace lazyccd::bullet
