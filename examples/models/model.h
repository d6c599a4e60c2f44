// Moving meshes from generators, for the study of balancing strategies: the models of the
// dissertation, made anew, so that anyone can run them. The same seed makes the same motion;
// positions are floats, so that the last bit of a sine on another machine rarely shows.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::models {

class Model {
 public:
  virtual ~Model() = default;

  // Three coordinates a vertex, in metres, at a time from 0 to 1 of the motion.
  virtual void positions(double time, std::vector<float>& out) const = 0;

  std::size_t vertex_count() const { return body_of_vertex_.size(); }
  const std::vector<Face>& faces() const { return faces_; }
  // Refers to this model.
  Topology topology() const;
  // Positions at frame 0 ... frames - 1 of the whole motion.
  std::vector<float> frame(int index) const;
  static constexpr int frames = 101;  // 100 steps

 protected:
  // A grid of n x n cells, vertices row by row.
  void add_grid(int n, std::int32_t body);
  // Returns the vertices of a unit sphere, whose faces are added: an icosahedron, each face in
  // four, so many times.
  std::vector<std::array<double, 3>> add_sphere(int subdivisions, std::int32_t body);

  std::vector<Face> faces_;
  std::vector<std::int32_t> body_of_vertex_;
  std::vector<Body> bodies_;
};

struct ModelName {
  const char* name;
  const char* meaning;
};
const std::vector<ModelName>& model_names();

// Throws Error(invalid_argument) that lists the names.
std::unique_ptr<Model> make_model(const std::string& name, std::uint64_t seed = 1);

// The generators, for make_model().
std::unique_ptr<Model> make_triangle_cloud(int triangles, std::uint64_t seed);
std::unique_ptr<Model> make_funnel(std::uint64_t seed);
std::unique_ptr<Model> make_cloth_ball(std::uint64_t seed);
std::unique_ptr<Model> make_n_body(std::uint64_t seed);

}  // namespace lazyccd::models
