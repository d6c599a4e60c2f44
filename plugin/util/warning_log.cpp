#include "util/warning_log.h"

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void WarningLog::warn_once(const std::string& key, const std::string& text) noexcept try {
  const bool known =
      std::any_of(lines_.begin(), lines_.end(), [&](const Line& line) { return line.key == key; });
  if (known) return;
  lines_.push_back({key, text});
  if (listener_) listener_(text);
} catch (...) {
  // Out of memory, or the listener threw: the step matters more than the message.
}

std::string WarningLog::text() const {
  std::string result;
  for (const Line& line : lines_) result += line.text + "\n";
  return result;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
