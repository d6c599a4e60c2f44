// Turns a mix of Bullet's two precisions into an error. Objects of the two have different layouts
// under the same names, so a mix of them compiles, links and crashes. The error comes
//   at compile time, if LAZYCCD_BULLET_DOUBLE is defined (0 or 1: the adapter that is linked; the
//   CMake targets LazyCCD::bullet and LazyCCD::bullet_double define it);
//   at link time always, because the precision is part of every symbol's name.
#pragma once

#include <LinearMath/btScalar.h>

#ifdef BT_USE_DOUBLE_PRECISION
#define LAZYCCD_BULLET_PRECISION double_precision
static_assert(sizeof(btScalar) == 8,
              "BT_USE_DOUBLE_PRECISION is defined but btScalar is not double");
#ifdef LAZYCCD_BULLET_DOUBLE
static_assert(
    LAZYCCD_BULLET_DOUBLE == 1,
    "BT_USE_DOUBLE_PRECISION is defined: link LazyCCD::bullet_double, not LazyCCD::bullet");
#endif
#else
#define LAZYCCD_BULLET_PRECISION single_precision
static_assert(sizeof(btScalar) == 4,
              "btScalar is not float but BT_USE_DOUBLE_PRECISION is not defined");
#ifdef LAZYCCD_BULLET_DOUBLE
static_assert(
    LAZYCCD_BULLET_DOUBLE == 0,
    "BT_USE_DOUBLE_PRECISION is not defined: link LazyCCD::bullet, not LazyCCD::bullet_double");
#endif
#endif
