// Two models of cloth whose motion is given by formulas, not by forces. Each cloth consists of
// rings around its centre. A ring that is longer than its circle forms pleats. The pleats keep the
// length of the ring, lean over with time and touch their neighbours.
#include <algorithm>
#include <cmath>

#include "models/model.h"
#include "models/random.h"

namespace lazyccd::models {
namespace {

constexpr double kTurn = 6.283185307179586;  // a full turn, radians

// The pleats of a cloth.
struct Pleats {
  int count;        // around the circle
  double phase[4];  // of the irregularities

  // Returns the point at `angle` of a ring that was a circle of radius `length` in the flat cloth
  // and is now pleated around a circle of `radius`. `lean`: how far the pleats lean over.
  void place(double length, double radius, double lean, double angle, double& x, double& y) const {
    // A wave of amplitude a with n periods around a circle is about as long as the hypotenuse of
    // the circle's length and 4 n a.
    const double spare = std::sqrt(std::max(length * length - radius * radius, 0.0));
    const double amplitude = kTurn * spare / (4 * count);
    const double uneven =
        1 + 0.3 * std::sin(3 * angle + phase[0]) + 0.2 * std::sin(7 * angle + phase[1]);
    const double wave = count * angle + 0.8 * std::sin(2 * angle + phase[2]);
    // The pleats lean sideways, the larger ones more.
    const double sideways = lean * amplitude * uneven * std::sin(2 * wave + phase[3]);
    const double r = std::max(radius + amplitude * uneven * std::cos(wave), 0.02 * radius);
    const double turned = angle + sideways / std::max(radius, 1e-6);
    x = r * std::cos(turned);
    y = r * std::sin(turned);
  }
};

Pleats random_pleats(int count, std::uint64_t seed) {
  Random random(seed);
  Pleats p{count, {}};
  for (double& x : p.phase) x = random.uniform(0, kTurn);
  return p;
}

double smooth(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

class Cloth : public Model {
 public:
  Cloth(int cells, int pleats, std::uint64_t seed)
      : cells_(cells), pleats_(random_pleats(pleats, seed)) {
    add_grid(cells, 0);
    bodies_.resize(1);
  }

 protected:
  // Moves every vertex of the grid. place(length, angle, out) gives the position of the point at
  // this distance and angle from the centre of the flat cloth.
  template <class Place>
  void place_grid(std::vector<float>& out, Place&& place) const {
    out.clear();
    for (int i = 0; i <= cells_; ++i) {
      for (int j = 0; j <= cells_; ++j) {
        const double u = 2.0 * i / cells_ - 1, v = 2.0 * j / cells_ - 1;
        double x[3];
        place(std::sqrt(u * u + v * v), std::atan2(v, u), x);
        for (const double k : x) out.push_back(static_cast<float>(k));
      }
    }
  }
  const Pleats& pleats() const { return pleats_; }

 private:
  int cells_;
  Pleats pleats_;
};

// A cloth that is pulled by its centre through a funnel, which is a wide cone with a neck below.
class Funnel : public Cloth {
 public:
  explicit Funnel(std::uint64_t seed) : Cloth(96, 22, seed) {}

  void positions(double time, std::vector<float>& out) const override {
    const double centre = 0.6 - 1.9 * time;
    const double lean = 0.9 * smooth(time) + 0.05 * std::sin(25 * time);
    place_grid(out, [&](double length, double angle, double* x) {
      // The rings follow the centre along the slope of the wall, with a soft bend at the centre.
      const double behind = std::sqrt(length * length + 0.04) - 0.2;
      const double z = centre + 0.9 * behind;
      const double wall = neck + slope * std::max(z, 0.0) + 0.02 * z * z * (z > 0);
      const double free = smooth((z - 0.3) / 0.5);
      const double radius = std::min(length, free * length + (1 - free) * std::min(wall, length));
      pleats().place(length, radius, lean, angle + 0.6 * time * (1 - free), x[0], x[1]);
      x[2] = z;
    });
  }

 private:
  static constexpr double neck = 0.22, slope = 0.9;
};

// A cloth that falls on a rotating ball and is wound around it.
class ClothBall : public Cloth {
 public:
  explicit ClothBall(std::uint64_t seed) : Cloth(213, 26, seed) {
    bodies_.resize(2);
    bodies_[1].self_collision = false;
    ball_ = add_sphere(3, 1);
  }

  void positions(double time, std::vector<float>& out) const override {
    const double drape = 0.05 + 0.95 * smooth(1.4 * time), lean = 0.8 * smooth(time);
    const double bend = ball_radius / drape;  // bending radius of the cloth, m
    const double twist = 2.5 * smooth(1.2 * time - 0.2);
    // The top of the cloth sinks onto the ball, then moves up and down a little.
    const double top = 0.25 * (1 - smooth(2 * time)) + 0.001 * std::sin(40 * time);
    place_grid(out, [&](double length, double angle, double* x) {
      const double quarter = 0.25 * kTurn * bend;
      double radius = bend * std::sin(std::min(length / bend, 0.25 * kTurn));
      double z = bend * (std::cos(std::min(length / bend, 0.25 * kTurn)) - 1);
      if (length > quarter) {
        z -= length - quarter;
        radius *= 1 - 0.35 * smooth((length - quarter) / 0.6) * smooth(time);
      }
      const double hanging = smooth(length / quarter);
      pleats().place(length, radius, lean * hanging, angle + twist * hanging, x[0], x[1]);
      x[2] = z + top;
    });
    const double c = std::cos(kTurn * time), s = std::sin(kTurn * time);
    for (const auto& p : ball_) {
      out.push_back(static_cast<float>(ball_radius * (c * p[0] - s * p[1])));
      out.push_back(static_cast<float>(ball_radius * (s * p[0] + c * p[1])));
      out.push_back(static_cast<float>(ball_radius * (p[2] - 1)));
    }
  }

 private:
  static constexpr double ball_radius = 0.4;
  std::vector<std::array<double, 3>> ball_;
};

}  // namespace

std::unique_ptr<Model> make_funnel(std::uint64_t seed) { return std::make_unique<Funnel>(seed); }
std::unique_ptr<Model> make_cloth_ball(std::uint64_t seed) {
  return std::make_unique<ClothBall>(seed);
}

}  // namespace lazyccd::models
