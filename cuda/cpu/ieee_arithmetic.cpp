#include "core/ieee_arithmetic.h"

namespace lazyccd {

bool has_ieee_arithmetic() {
  // Volatile, so that nothing is computed by the compiler. The product of x with itself is
  // 1 + 2^-26 + 2^-54: its last term is lost in rounding, unless the product is not rounded.
  volatile double x = 1 + 0x1p-27, half_unit = 0x1p-53, smallest = DBL_MIN;
  volatile float smallest_float = FLT_MIN;
  const double a = x, product = 1 + 0x1p-26;
  const double rest = a * a - product;
  // Half a unit in the last place is a tie, and so are one and a half; the last digit gets even.
  const double one_up = 1 + half_unit, one_down = -1 - half_unit, one_and_half = 1 + 3 * half_unit;
  const double denormal = smallest / 4;
  const float denormal_float = smallest_float / 4;
  return rest == 0 && one_up == 1 && one_down == -1 && one_and_half == 1 + 0x1p-51 &&
         denormal * 4 == smallest && denormal_float * 4 == smallest_float && denormal != 0 &&
         denormal_float != 0;
}

}  // namespace lazyccd
