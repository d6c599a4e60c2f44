// Clouds of single triangles, as in the museum scene of the Benchmark for Animated Ray Tracing
// (BART, Lext et al. 2001). Each triangle is a body, swings around its own place and rotates.
#include <cmath>

#include "models/model.h"
#include "models/random.h"

namespace lazyccd::models {
namespace {

constexpr double kFullTurn = 6.283185307179586;  // a full turn, radians

// Size of the triangles, metres; the swarm is one metre wide. Larger triangles overlap more, so the
// traversal expands more pairs of nodes down to the leaves. With this size the mean front over the
// motion is within a tenth of that of da Silva, table 4.3, for all four numbers of triangles: 731
// nodes (808 there), 9.6 K (9.16 K), 135 K (127 K) and 2.05 M (2.16 M).
constexpr double size = 0.2;

class TriangleCloud : public Model {
 public:
  TriangleCloud(int triangles, std::uint64_t seed) {
    Random random(seed);
    for (std::int32_t i = 0; i < triangles; ++i) {
      Swing s;
      for (int k = 0; k < 3; ++k) {
        s.centre[k] = random.uniform(0, 1);
        s.reach[k] = random.uniform(-0.2, 0.2);
        s.phase[k] = random.uniform(0, kFullTurn);
        s.corner[0][k] = random.uniform(-1, 1);
        s.corner[1][k] = random.uniform(-1, 1);
      }
      s.turns = random.uniform(-2, 2);
      swings_.push_back(s);
      faces_.push_back({3 * i, 3 * i + 1, 3 * i + 2});
      body_of_vertex_.insert(body_of_vertex_.end(), 3, i);
    }
  }

  void positions(double time, std::vector<float>& out) const override {
    out.clear();
    for (const Swing& s : swings_) {
      const double angle = kFullTurn * s.turns * time, c = std::cos(angle), d = std::sin(angle);
      for (int corner = 0; corner < 3; ++corner) {
        // The third corner is minus the sum of the other two. They rotate in their common plane.
        const double a = corner == 0 ? c : corner == 1 ? -d : d - c;
        const double b = corner == 0 ? d : corner == 1 ? c : -c - d;
        for (int k = 0; k < 3; ++k)
          out.push_back(static_cast<float>(s.centre[k] +
                                           s.reach[k] * std::sin(kFullTurn * time + s.phase[k]) +
                                           size * (a * s.corner[0][k] + b * s.corner[1][k])));
      }
    }
  }

 private:
  struct Swing {
    double centre[3], reach[3], phase[3], corner[2][3], turns;
  };
  std::vector<Swing> swings_;
};

}  // namespace

std::unique_ptr<Model> make_triangle_cloud(int triangles, std::uint64_t seed) {
  return std::make_unique<TriangleCloud>(triangles, seed);
}

}  // namespace lazyccd::models
