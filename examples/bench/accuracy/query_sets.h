// Sets of elementary queries with their exact truth.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/query.h"

namespace lazyccd::bench {

/// Queries of one kind.
struct QuerySet {
  std::string name;
  ContactKind kind;
  std::vector<QueryPoints> queries;
  std::vector<bool> hit;
  std::vector<double> toi;  // time of impact of each query; empty: unknown
};

/// Reads the sets in DIR/queries: every NAME_{vf,ee}.bin, with times of impact from
/// NAME_{vf,ee}_truth.csv if that exists, and every NAME/{vertex-face,edge-edge}/*.csv, with all
/// files of a folder as one set. Returns nothing if DIR does not exist.
std::vector<QuerySet> read_query_sets(const std::filesystem::path& data_dir);

}  // namespace lazyccd::bench
