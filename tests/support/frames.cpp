#include "support/frames.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "io/file.h"
#include "io/ply.h"

namespace lazyccd::test {

namespace {

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

// The first file of the folder, in alphabetical order, whose name contains `part`.
std::filesystem::path file_with(const std::filesystem::path& folder, const std::string& part) {
  for (const auto& file : files_in(folder)) {
    if (file.filename().string().find(part) != std::string::npos) return file;
  }
  throw std::runtime_error("no file *" + part + "* in " + folder.string());
}

const char* suffix_of(ContactKind kind) { return kind == ContactKind::vertex_face ? "vf" : "ee"; }

bool share_a_vertex(const PairKey& key) {
  return std::find_first_of(key.begin() + 1, key.begin() + 3, key.begin() + 3, key.end()) !=
             key.begin() + 3 ||
         (key[0] == static_cast<std::int32_t>(ContactKind::vertex_face) && key[1] == key[2]);
}

}  // namespace

PairKey key_of(ContactKind kind, std::array<std::int32_t, 4> v) {
  if (kind == ContactKind::vertex_face) {
    std::sort(v.begin() + 1, v.end());
  } else {
    std::sort(v.begin(), v.begin() + 2);
    std::sort(v.begin() + 2, v.end());
    if (std::pair(v[2], v[3]) < std::pair(v[0], v[1])) {
      std::swap(v[0], v[2]);
      std::swap(v[1], v[3]);
    }
  }
  return {static_cast<std::int32_t>(kind), v[0], v[1], v[2], v[3]};
}

PairKey key_of(const Contact& contact) { return key_of(contact.kind, contact.vertices); }

std::vector<Edge> unique_edges(const std::vector<Face>& faces) {
  std::vector<Edge> edges;
  for (const Face& face : faces) {
    for (std::size_t i = 0; i < 3; ++i) {
      edges.push_back({std::min(face[i], face[(i + 1) % 3]), std::max(face[i], face[(i + 1) % 3])});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::pair(a[1], a[0]) < std::pair(b[1], b[0]);
  });
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

std::vector<std::array<std::int32_t, 4>> read_listed_pairs(const std::filesystem::path& scene,
                                                           const io::Mesh& mesh, ContactKind kind) {
  const std::vector<Edge> edges = unique_edges(mesh.faces);
  const auto vertex_count = static_cast<std::int64_t>(mesh.vertices.size());
  const auto edge_count = static_cast<std::int64_t>(edges.size());
  const auto listed =
      nlohmann::json::parse(io::read_file(file_with(scene / "boxes", suffix_of(kind))))
          .get<std::vector<std::array<std::int64_t, 2>>>();
  std::vector<std::array<std::int32_t, 4>> pairs;
  for (auto [a, b] : listed) {
    if (a > b) std::swap(a, b);
    if (kind == ContactKind::vertex_face) {
      const Face& face = mesh.faces.at(static_cast<std::size_t>(b - vertex_count - edge_count));
      pairs.push_back({static_cast<std::int32_t>(a), face[0], face[1], face[2]});
    } else {
      const Edge& first = edges.at(static_cast<std::size_t>(a - vertex_count));
      const Edge& second = edges.at(static_cast<std::size_t>(b - vertex_count));
      pairs.push_back({first[0], first[1], second[0], second[1]});
    }
  }
  return pairs;
}

FramePair read_frame_pair(const std::filesystem::path& data, const std::string& scene) {
  const std::filesystem::path folder = data / "frames" / scene;
  const std::vector<std::filesystem::path> frames = files_in(folder / "frames");
  FramePair result{io::read_ply(frames.at(0)), io::read_ply(frames.at(1)), {}};
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
    const auto pairs = read_listed_pairs(folder, result.start, kind);
    const auto truth =
        nlohmann::json::parse(io::read_file(file_with(folder / "mma_bool", suffix_of(kind))))
            .get<std::vector<bool>>();
    if (pairs.size() != truth.size()) throw std::runtime_error("truth of another length: " + scene);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const PairKey key = key_of(kind, pairs[i]);
      if (truth[i] && !share_a_vertex(key)) result.colliding.insert(key);
    }
  }
  return result;
}

}  // namespace lazyccd::test
