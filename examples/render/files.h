// Images and films on disk.
#pragma once

#include <filesystem>
#include <memory>

#include "render/picture.h"

namespace lazyccd::render {

void write_png(const std::filesystem::path& path, const Image& image);

// An animated WebP that repeats for ever.
class Film {
 public:
  Film(int width, int height, int frames_per_second);
  ~Film();

  void add(const Image& image);
  // The last image stays for a second.
  void write(const std::filesystem::path& path);

 private:
  struct Encoder;
  std::unique_ptr<Encoder> encoder_;
  int ms_frame_, ms_ = 0;
};

}  // namespace lazyccd::render
