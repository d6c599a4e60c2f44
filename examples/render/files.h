// Writers of images and films.
#pragma once

#include <filesystem>
#include <memory>

#include "render/picture.h"

namespace lazyccd::render {

/// Writes a PNG file. Throws std::runtime_error on failure.
void write_png(const std::filesystem::path& path, const Image& image);

/// An animated WebP that repeats endlessly. add() and write() throw std::runtime_error on failure.
class Film {
 public:
  Film(int width, int height, int frames_per_second);
  ~Film();

  void add(const Image& image);
  /// Writes the film. The last image is shown for one second.
  void write(const std::filesystem::path& path);

 private:
  struct Encoder;
  std::unique_ptr<Encoder> encoder_;
  int ms_frame_, ms_ = 0;
};

}  // namespace lazyccd::render
