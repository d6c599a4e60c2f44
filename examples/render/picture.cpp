#include "render/picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "render/tracer.h"

namespace lazyccd::render {
namespace {

constexpr float pi = 3.14159265f;
const Colour glow = {1.0f, 0.02f, 0.05f};
const Colour ground = {0.86f, 0.86f, 0.88f};
constexpr float sun_size = 0.06f;  // radians; a larger sun makes softer shadows

// Returns two numbers in [0, 1). Over increasing `i` they fill the square evenly: the additive
// recurrence of the plastic number (M. Roberts). `seed` selects the start of the sequence; each
// pixel and purpose has its own.
std::array<float, 2> even(std::uint32_t i, std::uint32_t seed) {
  seed = (seed ^ 61u ^ (seed >> 16)) * 9u;
  seed = (seed ^ (seed >> 4)) * 0x27d4eb2du;
  seed ^= seed >> 15;
  const float a =
      static_cast<float>(seed & 0xffffu) / 65536.0f + 0.7548776662f * static_cast<float>(i);
  const float b = static_cast<float>(seed >> 16) / 65536.0f + 0.5698402910f * static_cast<float>(i);
  return {a - std::floor(a), b - std::floor(b)};
}

// Three orthogonal unit vectors.
struct Frame {
  Vector3f right, up, back;
};

Frame frame_along(const Vector3f& back, const Vector3f& up) {
  Frame f;
  f.back = back.normalized();
  f.right = up.cross(f.back).normalized();
  f.up = f.back.cross(f.right);
  return f;
}

// Returns a direction in the hemisphere about `normal`, with a density proportional to the cosine.
Vector3f scattered(const Vector3f& normal, const std::array<float, 2>& random) {
  const Vector3f aside = std::abs(normal[0]) < 0.7f ? Vector3f::UnitX() : Vector3f::UnitY();
  const Frame f = frame_along(normal, aside);
  const float r = std::sqrt(random[0]), angle = 2 * pi * random[1];
  return r * std::cos(angle) * f.right + r * std::sin(angle) * f.up +
         std::sqrt(1 - random[0]) * f.back;
}

// Draws one picture.
class Painter {
 public:
  Painter(const Picture& picture, const Camera& camera, int width, int height, int samples)
      : tracer_(picture),
        floor_(picture.floor),
        eye_(camera.eye[0], camera.eye[1], camera.eye[2]),
        target_(camera.target[0], camera.target[1], camera.target[2]),
        view_(frame_along(eye_ - target_, Vector3f::UnitY())),
        pixel_(2 * std::tan(camera.field / 2) / static_cast<float>(height)),
        sun_((-1.3f * view_.right + 1.9f * Vector3f::UnitY() + 0.7f * view_.back).normalized()),
        samples_(samples) {
    image_.width = width;
    image_.height = height;
    image_.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }

  Image paint() {
    std::atomic<int> next{0};
    const auto work = [&] {
      for (int row = next++; row < image_.height; row = next++) paint_row(row);
    };
    std::vector<std::thread> threads(std::max(1u, std::thread::hardware_concurrency()) - 1);
    for (std::thread& thread : threads) thread = std::thread(work);
    work();
    for (std::thread& thread : threads) thread.join();
    return std::move(image_);
  }

 private:
  void paint_row(int row) {
    for (int column = 0; column < image_.width; ++column) {
      const auto index = static_cast<std::uint32_t>(row * image_.width + column);
      Vector3f sum = Vector3f::Zero();
      for (int s = 0; s < samples_; ++s) {
        const auto i = static_cast<std::uint32_t>(s);
        const std::array<float, 2> in_pixel = even(i, 0);
        const float x =
            (static_cast<float>(column) + in_pixel[0] - 0.5f * static_cast<float>(image_.width)) *
            pixel_;
        const float y =
            (0.5f * static_cast<float>(image_.height) - static_cast<float>(row) - in_pixel[1]) *
            pixel_;
        sum += light(eye_, (x * view_.right + y * view_.up - view_.back).normalized(), i, index);
      }
      for (int k = 0; k < 3; ++k) {
        const float linear = std::clamp(sum[k] / static_cast<float>(samples_), 0.0f, 1.0f);
        image_.rgb[3 * std::size_t{index} + k] =
            static_cast<std::uint8_t>(std::lround(255 * std::pow(linear, 1 / 2.2f)));
      }
    }
  }

  Vector3f light(const Vector3f& origin, const Vector3f& direction, std::uint32_t sample,
                 std::uint32_t pixel) const {
    Hit hit;
    float fade = 0;  // of the ground into the background, 0 to 1
    if (!tracer_.hit(origin, direction, hit)) {
      const float distance = (floor_ - origin[1]) / direction[1];
      if (!(distance > 0)) return sky(direction);
      hit.point = origin + distance * direction;
      hit.normal = Vector3f::UnitY();
      hit.colour = ground;
      const float far = (hit.point - target_).norm() / (eye_ - target_).norm();
      fade = 1 - std::exp(-far * far);
    }
    if (hit.glows) return {glow[0], glow[1], glow[2]};
    const float lift = 1e-4f * (eye_ - target_).norm();
    const Vector3f from = hit.point + lift * hit.normal;
    Vector3f sum = Vector3f::Constant(0.04f);
    const std::array<float, 2> a = even(sample, 2 * pixel + 1), b = even(sample, 2 * pixel + 2);
    const Vector3f to_sun = (sun_ + sun_size * scattered(sun_, a)).normalized();
    const float slope = hit.normal.dot(to_sun);
    if (slope > 0 && !tracer_.blocked(from, to_sun)) sum += slope * Vector3f(0.70f, 0.67f, 0.60f);
    const Vector3f to_sky = scattered(hit.normal, b);
    if (!tracer_.blocked(from, to_sky)) {
      sum += to_sky[1] > 0 ? Vector3f(0.30f, 0.33f, 0.38f) : Vector3f(0.20f, 0.19f, 0.18f);
    }
    const Vector3f lit = sum.cwiseProduct(Vector3f(hit.colour[0], hit.colour[1], hit.colour[2]));
    return (1 - fade) * lit + fade * sky(direction);
  }

  static Vector3f sky(const Vector3f& direction) {
    const float height = std::clamp(direction[1] + 0.35f, 0.0f, 1.0f);
    return (1 - height) * Vector3f(0.92f, 0.92f, 0.93f) + height * Vector3f(0.62f, 0.72f, 0.85f);
  }

  Tracer tracer_;
  float floor_;
  Vector3f eye_, target_;
  Frame view_;
  float pixel_;  // width of a pixel at a distance of one metre, m
  Vector3f sun_;
  int samples_;
  Image image_;
};

}  // namespace

Image draw(const Picture& picture, const Camera& camera, int width, int height, int samples) {
  return Painter(picture, camera, width, height, samples).paint();
}

}  // namespace lazyccd::render
