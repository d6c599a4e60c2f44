// Which names a shared library shows. LAZYCCD_SHARED is defined for users of shared libraries,
// LAZYCCD_CORE_EXPORTS, LAZYCCD_RESEARCH_EXPORTS and LAZYCCD_BULLET_EXPORTS while one of them is
// compiled.
#pragma once

#if !defined(LAZYCCD_SHARED)
#define LAZYCCD_SHOWN
#define LAZYCCD_TAKEN
#elif defined(_WIN32)
#define LAZYCCD_SHOWN __declspec(dllexport)
#define LAZYCCD_TAKEN __declspec(dllimport)
#else
#define LAZYCCD_SHOWN __attribute__((visibility("default")))
#define LAZYCCD_TAKEN LAZYCCD_SHOWN
#endif

/// In front of what LazyCCD::core shows: its public interface, and what LazyCCD::research needs of
/// its inside.
#if defined(LAZYCCD_CORE_EXPORTS)
#define LAZYCCD_API LAZYCCD_SHOWN
#else
#define LAZYCCD_API LAZYCCD_TAKEN
#endif

/// In front of what LazyCCD::research shows.
#if defined(LAZYCCD_RESEARCH_EXPORTS)
#define LAZYCCD_RESEARCH_API LAZYCCD_SHOWN
#else
#define LAZYCCD_RESEARCH_API LAZYCCD_TAKEN
#endif

/// In front of what LazyCCD::bullet and LazyCCD::bullet_double show.
#if defined(LAZYCCD_BULLET_EXPORTS)
#define LAZYCCD_BULLET_API LAZYCCD_SHOWN
#else
#define LAZYCCD_BULLET_API LAZYCCD_TAKEN
#endif
