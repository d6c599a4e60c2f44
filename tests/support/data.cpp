#include "support/data.h"

#include <cstdio>
#include <cstdlib>

namespace lazyccd::test {

std::optional<std::filesystem::path> data_dir() {
  static const std::optional<std::filesystem::path> found = [] {
    const char* variable = std::getenv("LAZYCCD_DATA_DIR");
    const std::filesystem::path path =
        variable ? std::filesystem::path(variable)
                 : std::filesystem::path(LAZYCCD_SOURCE_DIR) / ".." / "shared" / "data";
    std::optional<std::filesystem::path> result;
    if (std::filesystem::is_directory(path)) result = path;
    return result;
  }();
  if (!found) std::printf("SKIPPED: no test data (set LAZYCCD_DATA_DIR)\n");
  return found;
}

}  // namespace lazyccd::test
