// Sets of elementary queries with their exact truth.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/query.h"

namespace lazyccd::bench {

struct QuerySet {
  std::string name;
  ContactKind kind;
  std::vector<QueryPoints> queries;
  std::vector<bool> hit;
  std::vector<double> toi;  // first time of contact, a number a query, or empty where unknown
};

// DIR/queries: every NAME_{vf,ee}.bin with NAME_{vf,ee}_truth.csv beside it where there is one, and
// every NAME/{vertex-face,edge-edge}/*.csv, pooled by folder. None where DIR is absent.
std::vector<QuerySet> read_query_sets(const std::filesystem::path& data_dir);

}  // namespace lazyccd::bench
