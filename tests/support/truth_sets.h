// Reads the queries of the test data and their exact answers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lazyccd/query.h"

namespace lazyccd::test {

/// Queries of one kind, with their answers.
struct TruthSet {
  std::string name;
  ContactKind kind;
  std::vector<QueryPoints> points;
  std::vector<bool> hit;
  /// First time of contact (17 digits) and Truth::Regularity. Empty if the set has no times.
  std::vector<double> toi;
  std::vector<int> regularity;
};

/// Reads data/queries: .bin files and folders of .csv files.
std::vector<TruthSet> read_query_truths(const std::filesystem::path& data);
/// Reads data/frames: the pairs that the ground truth lists.
std::vector<TruthSet> read_frame_truths(const std::filesystem::path& data);

}  // namespace lazyccd::test
