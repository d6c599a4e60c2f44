// Finds the large test data, which are not part of the repository.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace lazyccd::test {

/// Returns $LAZYCCD_DATA_DIR if it is set, else ../shared/data beside the repository. If the folder
/// does not exist, prints a message and returns nothing; a test that then returns shows as skipped.
std::optional<std::filesystem::path> data_dir();

}  // namespace lazyccd::test
