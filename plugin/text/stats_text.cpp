#include "text/stats_text.h"

#include <type_traits>

#include "text/number_text.h"

namespace lazyccd::text {

using bullet::StepStats;

std::string stats_text(const StepStats& s) {
  std::string lines;
  StepStats::for_each_member([&](const char* name, auto member) {
    const auto value = s.*member;
    lines += std::string(name) + " ";
    if constexpr (std::is_floating_point_v<std::decay_t<decltype(value)>>)
      lines += number_text(value);
    else
      lines += std::to_string(value);
    lines += "\n";
  });
  return lines;
}

}  // namespace lazyccd::text
