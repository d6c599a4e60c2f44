#include "support/temporary.h"

#include <stdlib.h>

#include <system_error>

namespace lazyccd::test {

TemporaryFolder::TemporaryFolder() {
  // mkdtemp() replaces the last six characters.
  std::string pattern =
      (std::filesystem::temp_directory_path() / "lazyccd-").string() + std::string(6, 'X');
  if (!mkdtemp(pattern.data())) {
    throw std::system_error(errno, std::generic_category(), "cannot make " + pattern);
  }
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace lazyccd::test
