// Remembers what was said, so that a fault that lasts a thousand steps is reported once.
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

  // `key` names the fault; what was said under it before is not said again.
  void warn_once(const std::string& key, const std::string& text) noexcept;
  // All lines so far, each ended by a newline.
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
