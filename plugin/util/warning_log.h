// Log of warnings that reports each fault once, even if it lasts a thousand steps.
#pragma once

#include <string>
#include <vector>

#include "lazyccd/bullet/options.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class WarningLog {
 public:
  explicit WarningLog(std::function<void(const std::string&)> listener)
      : listener_(std::move(listener)) {}

  /// Logs `text` and passes it to the listener, unless a warning with the same `key` is logged
  /// already.
  void warn_once(const std::string& key, const std::string& text) noexcept;
  /// All lines so far, each with a newline at its end.
  std::string text() const;

 private:
  struct Line {
    std::string key, text;
  };
  std::function<void(const std::string&)> listener_;
  std::vector<Line> lines_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
