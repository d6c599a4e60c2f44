#include "bench/frames.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include <nlohmann/json.hpp>

#include "io/file.h"
#include "io/ply.h"

namespace lazyccd::bench {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> sorted_files(const fs::path& folder, const std::string& ending) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() > ending.size() && name.substr(name.size() - ending.size()) == ending)
      found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Returns the number of edges of a mesh. The truth files number them in the order of
// Detector::edges().
std::size_t count_edges(const io::Mesh& mesh) {
  std::vector<Edge> edges;
  for (const Face& f : mesh.faces)
    for (int i = 0; i < 3; ++i) {
      const auto ends = std::minmax(f[i], f[(i + 1) % 3]);
      edges.push_back({ends.first, ends.second});
    }
  std::sort(edges.begin(), edges.end());
  return std::size_t(std::unique(edges.begin(), edges.end()) - edges.begin());
}

// Reads the pairs that touch. `boxes` lists the pairs; column `hit` of `truth` tells for each
// whether it touches. Indices in the file run through all vertices, then all edges, then all faces;
// `first` is the index of the first primitive of each side.
Pairs read_truth(const fs::path& boxes, const fs::path& truth, std::array<std::size_t, 2> first) {
  const auto pairs = nlohmann::json::parse(io::read_file(boxes));
  std::ifstream lines(truth);
  std::string line;
  std::getline(lines, line);  // query_index,hit,toi,flag
  Pairs touching;
  for (const auto& pair : pairs) {
    if (!std::getline(lines, line)) io::fail(truth.string(), "fewer lines than pairs");
    if (line.at(line.find(',') + 1) != '1') continue;
    touching.push_back({pair[0].get<std::int32_t>() - std::int32_t(first[0]),
                        pair[1].get<std::int32_t>() - std::int32_t(first[1])});
  }
  for (auto& pair : touching)
    if (first[0] == first[1] && pair[0] > pair[1]) std::swap(pair[0], pair[1]);
  std::sort(touching.begin(), touching.end());
  return touching;
}

}  // namespace

fs::path default_data_dir() {
  if (const char* set = std::getenv("LAZYCCD_DATA_DIR")) return set;
  return fs::path(LAZYCCD_SOURCE_DIR).parent_path() / "shared" / "data";
}

std::vector<FramePair> read_frames(const fs::path& data_dir) {
  std::vector<FramePair> pairs;
  if (!fs::is_directory(data_dir / "frames")) return pairs;
  for (const auto& entry : fs::directory_iterator(data_dir / "frames")) {
    const fs::path folder = entry.path();
    const auto frames = sorted_files(folder / "frames", ".ply");
    if (frames.size() != 2) continue;
    FramePair pair{
        folder.filename().string(), io::read_ply(frames[0]), io::read_ply(frames[1]), {}, {}};
    io::require_same_topology(pair.start, frames[0].string(), pair.end, frames[1].string());
    const std::size_t vertices = pair.start.vertices.size();
    const std::size_t edges = count_edges(pair.start);
    const auto vf = sorted_files(folder / "boxes", "vf.json");
    const auto ee = sorted_files(folder / "boxes", "ee.json");
    if (vf.size() == 1)
      pair.truth_vf = read_truth(vf[0], folder / "vf_truth.csv", {0, vertices + edges});
    if (ee.size() == 1)
      pair.truth_ee = read_truth(ee[0], folder / "ee_truth.csv", {vertices, vertices});
    pairs.push_back(std::move(pair));
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const FramePair& a, const FramePair& b) { return a.name < b.name; });
  return pairs;
}

FramePair waving_sheets(int quads, int layers) {
  FramePair pair;
  pair.name = "waving-sheets";
  for (int layer = 0; layer < layers; ++layer) {
    const auto first = std::int32_t(pair.start.vertices.size());
    for (int j = 0; j <= quads; ++j)
      for (int i = 0; i <= quads; ++i) {
        // Metres. The waves of two sheets differ, so that the sheets meet only in places. The waves
        // are steep, because Bullet skips parts of a mesh whose normals differ little.
        const double x = 2.0 * i / quads - 1, y = 2.0 * j / quads - 1;
        const double wave = 0.03 * std::sin(31 * x + layer) * std::cos(23 * y - 2 * layer);
        pair.start.vertices.push_back({x, y, 0.08 * layer + wave});
        pair.end.vertices.push_back(
            {x + 0.003 * std::sin(9 * y + layer), y + 0.002 * layer, 0.03 * layer + wave});
      }
    const auto at = [&](int i, int j) { return first + std::int32_t(j * (quads + 1) + i); };
    for (int j = 0; j < quads; ++j)
      for (int i = 0; i < quads; ++i) {
        pair.start.faces.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        pair.start.faces.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
  }
  pair.end.faces = pair.start.faces;
  return pair;
}

Difference difference(const Pairs& truth, const Pairs& found) {
  Pairs missed, extra;
  std::set_difference(truth.begin(), truth.end(), found.begin(), found.end(),
                      std::back_inserter(missed));
  std::set_difference(found.begin(), found.end(), truth.begin(), truth.end(),
                      std::back_inserter(extra));
  return {missed.size(), extra.size()};
}

}  // namespace lazyccd::bench
