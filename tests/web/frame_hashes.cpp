// Prints a line for each frame of every generated model, and of the data folder if there is one:
// its name, a hash of the positions at both ends, the number of contacts and their hash. run.sh
// compares the lines of a native build with those of WebAssembly.
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "io/ply.h"
#include "lazyccd/detector.h"
#include "models/model.h"
#include "support/data.h"

using namespace lazyccd;

namespace {

constexpr int step = 5;  // every fifth step of a model

// FNV-1a.
template <class Number>
std::uint64_t hash_of(const std::vector<Number>& numbers, std::uint64_t hash) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(numbers.data());
  for (std::size_t i = 0; i < numbers.size() * sizeof(Number); ++i)
    hash = (hash ^ bytes[i]) * 1099511628211u;
  return hash;
}

template <class Number>
void print(const std::string& name, Detector& detector, const std::vector<Number>& start,
           const std::vector<Number>& end) {
  const auto positions = [](const std::vector<Number>& x) {
    return Positions(x.data(), x.size() / 3);
  };
  const Span<const Contact> contacts = detector.detect(positions(start), positions(end));
  std::printf("%s %016llx %zu %016llx\n", name.c_str(),
              static_cast<unsigned long long>(hash_of(end, hash_of(start, 14695981039346656037u))),
              contacts.size(), static_cast<unsigned long long>(contact_hash(contacts)));
}

std::vector<double> coordinates(const io::Mesh& mesh) {
  std::vector<double> x;
  for (const auto& vertex : mesh.vertices) x.insert(x.end(), vertex.begin(), vertex.end());
  return x;
}

}  // namespace

int main() {
  DetectorOptions options;
  options.threads = 1;
  for (const models::ModelName& name : models::model_names()) {
    const auto model = models::make_model(name.name);
    Detector detector(options);
    detector.set_topology(model->topology());
    for (int i = 0; i + 1 < models::Model::frames; i += step)
      print(std::string(name.name) + ":" + std::to_string(i), detector, model->frame(i),
            model->frame(i + 1));
  }
  const auto data = test::data_dir();
  if (!data) return 0;
  for (const auto& folder : std::filesystem::directory_iterator(*data / "frames")) {
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::directory_iterator(folder.path() / "frames"))
      if (file.path().extension() == ".ply") files.push_back(file.path());
    if (files.size() != 2) continue;
    if (files[1] < files[0]) std::swap(files[0], files[1]);
    const io::Mesh start = io::read_ply(files[0]), end = io::read_ply(files[1]);
    Detector detector(options);
    Topology topology;
    topology.vertex_count = start.vertices.size();
    topology.faces = start.faces;
    detector.set_topology(topology);
    print(folder.path().filename().string(), detector, coordinates(start), coordinates(end));
  }
}
