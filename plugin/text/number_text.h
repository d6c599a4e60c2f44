// Numbers as text that other languages read.
#pragma once

#include <locale>
#include <sstream>
#include <string>

namespace lazyccd::text {

/// All digits of the number, with a point in every locale.
inline std::string number_text(double value) {
  std::ostringstream digits;
  digits.imbue(std::locale::classic());
  digits.precision(17);
  digits << value;
  return digits.str();
}

}  // namespace lazyccd::text
