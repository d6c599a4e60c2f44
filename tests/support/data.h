// Where the large test data are: not part of the repository.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace lazyccd::test {

// $LAZYCCD_DATA_DIR, else ../shared/data beside the repository; nothing where it is absent,
// which it prints, so that a test that then returns shows as skipped.
std::optional<std::filesystem::path> data_dir();

}  // namespace lazyccd::test
