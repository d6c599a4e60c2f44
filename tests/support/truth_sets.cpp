#include "support/truth_sets.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "io/ply.h"
#include "io/queries.h"
#include "support/frames.h"

namespace lazyccd::test {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(folder)) entries.push_back(entry.path());
  std::sort(entries.begin(), entries.end());
  return entries;
}

// Columns query_index,hit,toi,flag.
void read_truth(const fs::path& path, TruthSet& set) {
  std::ifstream lines(path);
  std::string line;
  std::getline(lines, line);
  set.hit.clear();
  while (std::getline(lines, line)) {
    const std::size_t hit = line.find(',') + 1, toi = line.find(',', hit) + 1;
    const std::size_t flag = line.find(',', toi) + 1;
    set.hit.push_back(line[hit] == '1');
    set.toi.push_back(std::strtod(line.c_str() + toi, nullptr));
    set.regularity.push_back(line[flag] - '0');
  }
  if (set.hit.size() != set.points.size())
    throw std::runtime_error(path.string() + ": not one line a query");
}

void append(const fs::path& path, TruthSet& set) {
  const io::QueryFile file = io::read_queries(path);
  set.points.insert(set.points.end(), file.points.begin(), file.points.end());
  set.hit.insert(set.hit.end(), file.truth.begin(), file.truth.end());
}

}  // namespace

std::vector<TruthSet> read_query_truths(const fs::path& data) {
  std::vector<TruthSet> sets;
  for (const fs::path& path : sorted_entries(data / "queries")) {
    const std::string name = path.stem().string();
    if (path.extension() == ".bin") {
      const bool vf = name.substr(name.size() - 3) == "_vf";
      TruthSet set{name, vf ? ContactKind::vertex_face : ContactKind::edge_edge, {}, {}, {}, {}};
      append(path, set);
      const fs::path truth = path.parent_path() / (name + "_truth.csv");
      if (fs::exists(truth)) read_truth(truth, set);
      sets.push_back(std::move(set));
    } else if (fs::is_directory(path)) {
      for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
        const char* folder = kind == ContactKind::vertex_face ? "vertex-face" : "edge-edge";
        TruthSet set{name + " " + folder, kind, {}, {}, {}, {}};
        for (const fs::path& file : sorted_entries(path / folder)) append(file, set);
        sets.push_back(std::move(set));
      }
    }
  }
  return sets;
}

std::vector<TruthSet> read_frame_truths(const fs::path& data) {
  std::vector<TruthSet> sets;
  for (const fs::path& scene : sorted_entries(data / "frames")) {
    const std::vector<fs::path> frames = sorted_entries(scene / "frames");
    const io::Mesh start = io::read_ply(frames.at(0)), end = io::read_ply(frames.at(1));
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      const char* suffix = kind == ContactKind::vertex_face ? "vf" : "ee";
      TruthSet set{scene.filename().string() + " " + suffix, kind, {}, {}, {}, {}};
      for (const auto& vertices : read_listed_pairs(scene, start, kind)) {
        QueryPoints points;
        for (std::size_t i = 0; i < 4; ++i) {
          points[i] = start.vertices[static_cast<std::size_t>(vertices[i])];
          points[i + 4] = end.vertices[static_cast<std::size_t>(vertices[i])];
        }
        set.points.push_back(points);
      }
      read_truth(scene / (std::string(suffix) + "_truth.csv"), set);
      sets.push_back(std::move(set));
    }
  }
  return sets;
}

}  // namespace lazyccd::test
