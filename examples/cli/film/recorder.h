// Draws frames of a running scene as pictures and a film.
#pragma once

#include <filesystem>

#include "render/files.h"
#include "scenes/scene.h"

namespace lazyccd::program {

/// Draws one scene. The scene must outlive it.
class Recorder {
 public:
  /// Creates the folder. Pictures are folder/STEP.png with five digits; the film is
  /// folder/film.webp. `width` in pixels, `samples` rays a pixel.
  Recorder(const scenes::Scene& scene, const std::filesystem::path& folder, int width, int samples);

  void add(int step);  // draws the scene as it is now
  void finish();       // writes the film

 private:
  render::Picture picture() const;

  const scenes::Scene& scene_;
  std::filesystem::path folder_;
  int width_, height_, samples_;
  render::Camera camera_;
  double extent_;  // half the diagonal of the scene's box at the start, m
  float floor_;
  render::Film film_;
};

}  // namespace lazyccd::program
