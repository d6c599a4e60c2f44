// Copy to memory that the processor does not read again soon, past its caches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__) || defined(_M_X64)
#define LAZYCCD_HAS_STREAM_STORES
#include <immintrin.h>
#endif

namespace lazyccd::gpu {

/// Copies `bytes` from `from` to `to`. Ordinary stores would first read what they overwrite.
/// Another reader, as a device, sees the bytes after finish_stream_copies() of this thread.
inline void stream_copy(void* to, const void* from, std::size_t bytes) {
  char* out = static_cast<char*>(to);
  const char* in = static_cast<const char*>(from);
#if defined(LAZYCCD_HAS_STREAM_STORES)
  constexpr std::size_t piece = sizeof(__m128i);
  if (reinterpret_cast<std::uintptr_t>(out) % piece == 0)
    for (; bytes >= piece; bytes -= piece, in += piece, out += piece)
      _mm_stream_si128(reinterpret_cast<__m128i*>(out),
                       _mm_loadu_si128(reinterpret_cast<const __m128i*>(in)));
#endif
  std::memcpy(out, in, bytes);
}

inline void finish_stream_copies() {
#if defined(LAZYCCD_HAS_STREAM_STORES)
  _mm_sfence();
#endif
}

}  // namespace lazyccd::gpu
