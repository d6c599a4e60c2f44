// What the C library of Visual C++ declares and that of MinGW-w64 does not, for msvc.sh: libc++
// expects it.
#pragma once

#include <locale.h>
#include <math.h>

extern "C" {
float _strtof_l(const char* text, char** end, _locale_t locale);
long double _strtold_l(const char* text, char** end, _locale_t locale);
}

// Functions there, macros here.
#undef isfinite
#undef isinf
#undef isnan
#undef signbit
inline bool isfinite(double x) { return x - x == 0; }
inline bool isinf(double x) { return !isfinite(x) && x == x; }
inline bool isnan(double x) { return x != x; }
inline bool signbit(double x) { return __builtin_signbit(x); }
