#include "support/temporary.h"

#include <random>
#include <string>
#include <system_error>

namespace lazyccd::test {

TemporaryFolder::TemporaryFolder() {
  const std::filesystem::path parent = std::filesystem::temp_directory_path();
  std::random_device random;
  do {
    path_ = parent / ("lazyccd-" + std::to_string(random()));
  } while (!std::filesystem::create_directory(path_));  // false if it is there already
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace lazyccd::test
