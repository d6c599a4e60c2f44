#include "bench/accuracy/query_sets.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include "io/file.h"
#include "io/queries.h"

namespace lazyccd::bench {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  if (fs::is_directory(folder))
    for (const auto& entry : fs::directory_iterator(folder)) entries.push_back(entry.path());
  std::sort(entries.begin(), entries.end());
  return entries;
}

// Reads the times of impact. The columns are query_index,hit,toi,flag; toi is inf for a miss.
void read_times(const fs::path& path, QuerySet& set) {
  std::ifstream lines(path);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    const std::size_t toi = line.find(',', line.find(',') + 1) + 1;
    set.toi.push_back(std::strtod(line.c_str() + toi, nullptr));
  }
  if (set.toi.size() != set.queries.size())
    io::fail(path.string(), "expected one line for each query");
}

// Appends the queries of a file to a set.
void append(QuerySet& set, const fs::path& path) {
  const io::QueryFile file = io::read_queries(path);
  if (file.truth.size() != file.points.size()) io::fail(path.string(), "has no truth");
  set.queries.insert(set.queries.end(), file.points.begin(), file.points.end());
  for (const std::uint8_t hit : file.truth) set.hit.push_back(hit != 0);
}

}  // namespace

std::vector<QuerySet> read_query_sets(const fs::path& data_dir) {
  std::vector<QuerySet> sets;
  for (const fs::path& path : sorted_entries(data_dir / "queries")) {
    const std::string stem = path.stem().string();
    if (path.extension() == ".bin" && stem.size() > 3) {
      QuerySet set{
          stem.substr(0, stem.size() - 3),
          stem.substr(stem.size() - 3) == "_vf" ? ContactKind::vertex_face : ContactKind::edge_edge,
          {},
          {},
          {}};
      append(set, path);
      const fs::path times = path.parent_path() / (stem + "_truth.csv");
      if (fs::exists(times)) read_times(times, set);
      sets.push_back(std::move(set));
    }
    for (const auto kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      const bool vf = kind == ContactKind::vertex_face;
      QuerySet set{path.filename().string(), kind, {}, {}, {}};
      for (const fs::path& file : sorted_entries(path / (vf ? "vertex-face" : "edge-edge")))
        if (file.extension() == ".csv") append(set, file);
      if (!set.queries.empty()) sets.push_back(std::move(set));
    }
  }
  return sets;
}

}  // namespace lazyccd::bench
