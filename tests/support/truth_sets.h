// The queries of the test data with their truth.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lazyccd/query.h"

namespace lazyccd::test {

struct TruthSet {
  std::string name;
  ContactKind kind;
  std::vector<QueryPoints> points;
  std::vector<bool> hit;
  // Empty where the set has no times: first time of contact (17 digits), and Truth::Regularity.
  std::vector<double> toi;
  std::vector<int> regularity;
};

// DIR/queries: .bin files and folders of .csv files.
std::vector<TruthSet> read_query_truths(const std::filesystem::path& data);
// DIR/frames: the listed pairs.
std::vector<TruthSet> read_frame_truths(const std::filesystem::path& data);

}  // namespace lazyccd::test
