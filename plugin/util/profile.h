// Zones of Bullet's profiler: named spans of time, nested as the calls are.
#pragma once

#if defined(LAZYCCD_PROFILE)

#include <LinearMath/btQuickprof.h>

#define LAZYCCD_JOIN_NAMES(a, b) a##b
#define LAZYCCD_NAME_AT(name, line) LAZYCCD_JOIN_NAMES(name, line)

/// Opens a zone until the end of the scope, as BT_PROFILE does; nothing without the CMake option
/// LAZYCCD_PROFILE. For the thread that calls the solver alone, and not for inner loops.
#define LAZYCCD_BT_PROFILE(name) const CProfileSample LAZYCCD_NAME_AT(zone_of_line_, __LINE__)(name)

#else
#define LAZYCCD_BT_PROFILE(name) static_cast<void>(0)
#endif
