// Frames of a running scene as pictures and a film.
#pragma once

#include <filesystem>

#include "render/files.h"
#include "scenes/scene.h"

namespace lazyccd::program {

class Recorder {
 public:
  // Pictures go to folder/00000.png and so on, the film to folder/film.webp.
  Recorder(const scenes::Scene& scene, const std::filesystem::path& folder, int width, int samples);

  void add(int step);
  void finish();

 private:
  render::Picture picture() const;

  const scenes::Scene& scene_;
  std::filesystem::path folder_;
  int width_, height_, samples_;
  render::Camera camera_;
  double extent_;  // m, of what is to be seen
  float floor_;
  render::Film film_;
};

}  // namespace lazyccd::program
