#include "models/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "lazyccd/error.h"

namespace lazyccd::models {

Topology Model::topology() const {
  Topology t;
  t.vertex_count = body_of_vertex_.size();
  t.faces = faces_;
  t.body_of_vertex = body_of_vertex_;
  t.bodies = bodies_;
  return t;
}

std::vector<float> Model::frame(int index) const {
  std::vector<float> out;
  positions(static_cast<double>(index) / (frames - 1), out);
  return out;
}

void Model::add_grid(int n, std::int32_t body) {
  const auto first = static_cast<std::int32_t>(body_of_vertex_.size());
  body_of_vertex_.resize(body_of_vertex_.size() + static_cast<std::size_t>((n + 1) * (n + 1)),
                         body);
  for (std::int32_t i = 0; i < n; ++i) {
    for (std::int32_t j = 0; j < n; ++j) {
      const std::int32_t a = first + i * (n + 1) + j, b = a + n + 1;
      faces_.push_back({a, b, a + 1});
      faces_.push_back({a + 1, b, b + 1});
    }
  }
}

std::vector<std::array<double, 3>> Model::add_sphere(int subdivisions, std::int32_t body) {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  std::vector<std::array<double, 3>> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                               {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                               {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Face> faces = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                             {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                             {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                             {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int i = 0; i < subdivisions; ++i) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [at, made] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                  static_cast<std::int32_t>(points.size()));
      if (made) {
        std::array<double, 3> m;
        for (std::size_t k = 0; k < 3; ++k) m[k] = 0.5 * (points[a][k] + points[b][k]);
        points.push_back(m);
      }
      return at->second;
    };
    std::vector<Face> finer;
    for (const Face& f : faces) {
      const std::int32_t a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      finer.insert(finer.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
    }
    faces = finer;
  }
  for (auto& p : points) {
    const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (double& x : p) x /= length;
  }
  const auto first = static_cast<std::int32_t>(body_of_vertex_.size());
  body_of_vertex_.resize(body_of_vertex_.size() + points.size(), body);
  for (const Face& f : faces) faces_.push_back({first + f[0], first + f[1], first + f[2]});
  return points;
}

const std::vector<ModelName>& model_names() {
  static const std::vector<ModelName> names = {
      {"cloud-64", "a swarm of 64 single triangles, after the museum of the BART benchmark"},
      {"cloud-256", "the same with 256 triangles"},
      {"cloud-1024", "the same with 1024 triangles"},
      {"cloud-4096", "the same with 4096 triangles"},
      {"funnel", "a cloth of 18 432 triangles is pulled through a funnel"},
      {"cloth-ball", "a cloth of 90 738 triangles wraps around a ball of 1280 triangles"},
      {"n-body", "458 balls of 320 triangles each attract each other and collide"},
  };
  return names;
}

std::unique_ptr<Model> make_model(const std::string& name, std::uint64_t seed) {
  for (const int triangles : {64, 256, 1024, 4096})
    if (name == "cloud-" + std::to_string(triangles)) return make_triangle_cloud(triangles, seed);
  if (name == "funnel") return make_funnel(seed);
  if (name == "cloth-ball") return make_cloth_ball(seed);
  if (name == "n-body") return make_n_body(seed);
  std::string names;
  for (const ModelName& m : model_names())
    names += (names.empty() ? "" : ", ") + std::string(m.name);
  throw Error(ErrorCode::invalid_argument,
              "there is no model '" + name + "'; the models are " + names);
}

}  // namespace lazyccd::models
