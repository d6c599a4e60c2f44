#include "io/mesh.h"

#include <algorithm>

#include "lazyccd/error.h"

namespace lazyccd::io {

namespace {

std::string to_string(const Face& face) {
  return "(" + std::to_string(face[0]) + ", " + std::to_string(face[1]) + ", " +
         std::to_string(face[2]) + ")";
}

void require_same_count(const char* what, std::size_t a, const std::string& start_name,
                        std::size_t b, const std::string& end_name) {
  if (a == b) return;
  throw Error(ErrorCode::size_mismatch, "the two frames differ in topology: " + start_name +
                                            " has " + std::to_string(a) + " " + what + ", " +
                                            end_name + " has " + std::to_string(b));
}

}  // namespace

Topology topology(const Mesh& mesh) {
  Topology result;
  result.vertex_count = mesh.vertices.size();
  result.faces = mesh.faces;
  return result;
}

Positions positions(const Mesh& mesh) {
  return Positions(reinterpret_cast<const double*>(mesh.vertices.data()), mesh.vertices.size());
}

void require_same_topology(const Mesh& start, const std::string& start_name, const Mesh& end,
                           const std::string& end_name) {
  require_same_count("vertices", start.vertices.size(), start_name, end.vertices.size(), end_name);
  require_same_count("faces", start.faces.size(), start_name, end.faces.size(), end_name);
  const auto [a, b] = std::mismatch(start.faces.begin(), start.faces.end(), end.faces.begin());
  if (a == start.faces.end()) return;
  const auto face = a - start.faces.begin();
  throw Error(ErrorCode::size_mismatch,
              "the two frames differ in topology: face " + std::to_string(face) + " is " +
                  to_string(*a) + " in " + start_name + " and " + to_string(*b) + " in " + end_name,
              -1, static_cast<std::int32_t>(face));
}

}  // namespace lazyccd::io
