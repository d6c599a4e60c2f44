// Rotating balls that attract each other and collide. Motion is rigid; contacts are between bodies.
#include <array>
#include <cmath>

#include "models/model.h"
#include "models/random.h"

namespace lazyccd::models {
namespace {

using Point = std::array<double, 3>;

class NBody : public Model {
 public:
  explicit NBody(std::uint64_t seed) {
    Random random(seed);
    std::vector<Point> x(count), v(count);
    for (std::size_t i = 0; i < count; ++i) {
      shape_ = add_sphere(2, static_cast<std::int32_t>(i));
      Body body;
      body.self_collision = false;
      bodies_.push_back(body);
      do {
        for (double& k : x[i]) k = random.uniform(-1, 1);
      } while (x[i][0] * x[i][0] + x[i][1] * x[i][1] + x[i][2] * x[i][2] > 1);
      Point axis;
      for (std::size_t k = 0; k < 3; ++k) {
        v[i][k] = random.uniform(-0.3, 0.3);
        axis[k] = random.uniform(-1, 1);
      }
      const double length = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
      for (double& k : axis) k /= length;
      axes_.push_back(axis);
      turns_.push_back(random.uniform(-6, 6));
    }
    simulate(x, v);
  }

  void positions(double time, std::vector<float>& out) const override {
    const double at = time * (frames - 1);
    const auto frame = std::min(static_cast<std::size_t>(at), paths_.size() - 2);
    const double part = at - static_cast<double>(frame);
    out.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const double c = std::cos(turns_[i] * time), s = std::sin(turns_[i] * time);
      const Point& n = axes_[i];
      for (const Point& p : shape_) {
        // Rodrigues' rotation formula.
        const double along = (1 - c) * (n[0] * p[0] + n[1] * p[1] + n[2] * p[2]);
        const Point across = {n[1] * p[2] - n[2] * p[1], n[2] * p[0] - n[0] * p[2],
                              n[0] * p[1] - n[1] * p[0]};
        for (std::size_t k = 0; k < 3; ++k) {
          const double centre = (1 - part) * paths_[frame][i][k] + part * paths_[frame + 1][i][k];
          out.push_back(
              static_cast<float>(centre + radius * (c * p[k] + s * across[k] + along * n[k])));
        }
      }
    }
  }

 private:
  static constexpr std::size_t count = 458;
  static constexpr double radius = 0.075;

  // Computes the paths of the centres by symplectic Euler: softened attraction, and springs between
  // balls that overlap.
  void simulate(std::vector<Point>& x, std::vector<Point>& v) {
    constexpr int substeps = 4;
    constexpr double dt = 1.5 / (frames - 1) / substeps, pull = 1.2 / count, spring = 400;
    for (int frame = 0; frame < frames; ++frame) {
      paths_.push_back(x);
      for (int step = 0; step < substeps; ++step) {
        for (std::size_t i = 0; i < count; ++i) {
          for (std::size_t j = i + 1; j < count; ++j) {
            Point d;
            double squared = 0;
            for (std::size_t k = 0; k < 3; ++k) {
              d[k] = x[j][k] - x[i][k];
              squared += d[k] * d[k];
            }
            const double distance = std::sqrt(squared),
                         soft = std::sqrt(squared + 4 * radius * radius);
            double force = pull / (soft * soft * soft);
            if (distance < 2 * radius && distance > 0)
              force -= spring * (2 * radius - distance) / distance;
            for (std::size_t k = 0; k < 3; ++k) {
              v[i][k] += dt * force * d[k];
              v[j][k] -= dt * force * d[k];
            }
          }
        }
        for (std::size_t i = 0; i < count; ++i)
          for (std::size_t k = 0; k < 3; ++k) x[i][k] += dt * v[i][k];
      }
    }
  }

  std::vector<Point> shape_, axes_;
  std::vector<double> turns_;
  std::vector<std::vector<Point>> paths_;  // positions of the centres, by frame
};

}  // namespace

std::unique_ptr<Model> make_n_body(std::uint64_t seed) { return std::make_unique<NBody>(seed); }

}  // namespace lazyccd::models
