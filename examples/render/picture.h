// Draws triangle meshes and ropes by ray tracing on the CPU, with soft shadows and light from the
// sky. Needs no display and no graphics driver.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::render {

using Point = std::array<float, 3>;   // m
using Colour = std::array<float, 3>;  // linear, 0 to 1

/// A surface that is visible from both sides.
struct Mesh {
  std::vector<Point> vertices;
  std::vector<Face> faces;
  Colour front = {0.8f, 0.8f, 0.8f}, back = front;
  /// Edges between faces at a larger angle than this (radians) look sharp; 4: none does.
  float crease = 4;
};

/// Round rods of one radius between points.
struct Rope {
  std::vector<Point> points;
  std::vector<Edge> links;
  float radius = 0.01f;  // m
  Colour colour = {0.8f, 0.8f, 0.8f};
};

struct Picture {
  std::vector<Mesh> meshes;
  std::vector<Rope> ropes;
  std::vector<Point> marks;   // bright dots; surfaces hide them
  float mark_radius = 0.01f;  // m
  float floor = 0;            // height of the ground, m
};

struct Camera {
  Point eye, target;
  float field = 0.5f;  // vertical angle of view, radians
};

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // three bytes a pixel, rows from the top
};

/// Draws a picture with `samples` rays a pixel. Each ray adds one ray to the sun and one to the
/// sky. The result is the same in every run and with any number of threads.
Image draw(const Picture& picture, const Camera& camera, int width, int height, int samples);

}  // namespace lazyccd::render
