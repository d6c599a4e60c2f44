// Generated moving meshes for the study of balancing strategies. They recreate the models of V. da
// Silva, "Lazy Work Stealing for Continuous Hierarchy Traversal on Deformable Bodies" (M.Sc.
// dissertation, COPPE/UFRJ), so that anyone can run them. The same seed gives the same motion.
// Positions are floats: a difference in the last bit of a sine between machines rarely reaches
// them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::models {

/// A mesh of fixed topology and its motion.
class Model {
 public:
  virtual ~Model() = default;

  /// Writes three coordinates a vertex, in metres. `time` runs from 0 to 1 over the whole motion.
  virtual void positions(double time, std::vector<float>& out) const = 0;

  std::size_t vertex_count() const { return body_of_vertex_.size(); }
  const std::vector<Face>& faces() const { return faces_; }
  /// The result refers to this model.
  Topology topology() const;
  /// Returns the positions at frame `index`, from 0 to frames - 1.
  std::vector<float> frame(int index) const;
  static constexpr int frames = 101;  // 100 steps

 protected:
  /// Adds a grid of n x n cells. Its vertices are numbered row by row.
  void add_grid(int n, std::int32_t body);
  /// Adds the faces of a sphere and returns its vertices on the unit sphere. It is an icosahedron
  /// whose faces are divided into four, `subdivisions` times.
  std::vector<std::array<double, 3>> add_sphere(int subdivisions, std::int32_t body);

  std::vector<Face> faces_;
  std::vector<std::int32_t> body_of_vertex_;
  std::vector<Body> bodies_;
};

/// A model that make_model() knows.
struct ModelName {
  const char* name;
  const char* meaning;
};
const std::vector<ModelName>& model_names();

/// Makes a model by its name. Throws Error(invalid_argument) that lists the names.
std::unique_ptr<Model> make_model(const std::string& name, std::uint64_t seed = 1);

// The generators that make_model() calls.
std::unique_ptr<Model> make_triangle_cloud(int triangles, std::uint64_t seed);
std::unique_ptr<Model> make_funnel(std::uint64_t seed);
std::unique_ptr<Model> make_cloth_ball(std::uint64_t seed);
std::unique_ptr<Model> make_n_body(std::uint64_t seed);

}  // namespace lazyccd::models
