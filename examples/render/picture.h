// Pictures of triangles and ropes by ray tracing on the CPU: soft shadows, light from the sky, no
// display and no graphics driver.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::render {

using Point = std::array<float, 3>;   // m
using Colour = std::array<float, 3>;  // linear, 0 to 1

// A surface seen from both sides.
struct Mesh {
  std::vector<Point> vertices;
  std::vector<Face> faces;
  Colour front = {0.8f, 0.8f, 0.8f}, back = front;
  // Faces that meet at a larger angle than this, radians, meet in an edge.
  float crease = 4;
};

struct Rope {
  std::vector<Point> points;
  std::vector<Edge> links;
  float radius = 0.01f;
  Colour colour = {0.8f, 0.8f, 0.8f};
};

struct Picture {
  std::vector<Mesh> meshes;
  std::vector<Rope> ropes;
  std::vector<Point> marks;  // bright dots, seen through nothing
  float mark_radius = 0.01f;
  float floor = 0;  // height of the ground
};

struct Camera {
  Point eye, target;
  float field = 0.5f;  // vertical angle of view, radians
};

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // rows from the top
};

// `samples` rays a pixel; each brings a ray to the sun and one to the sky with it. The same on
// every run, whatever the number of threads.
Image draw(const Picture& picture, const Camera& camera, int width, int height, int samples);

}  // namespace lazyccd::render
