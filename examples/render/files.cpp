#include "render/files.h"

#include <png.h>
#include <webp/encode.h>
#include <webp/mux.h>

#include <stdexcept>

#include "io/file.h"

namespace lazyccd::render {

void write_png(const std::filesystem::path& path, const Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;
  if (!png_image_write_to_file(&header, path.c_str(), 0, image.rgb.data(), 0, nullptr)) {
    throw std::runtime_error(path.string() + ": " + header.message);
  }
}

struct Film::Encoder {
  WebPAnimEncoder* animation;
  WebPConfig config;
  ~Encoder() { WebPAnimEncoderDelete(animation); }
};

Film::Film(int width, int height, int frames_per_second)
    : encoder_(std::make_unique<Encoder>()), ms_frame_(1000 / frames_per_second) {
  encoder_->animation = WebPAnimEncoderNew(width, height, nullptr);
  WebPConfigInit(&encoder_->config);
}

Film::~Film() = default;

void Film::add(const Image& image) {
  WebPPicture picture;
  WebPPictureInit(&picture);
  picture.width = image.width;
  picture.height = image.height;
  picture.use_argb = 1;
  const bool added = WebPPictureImportRGB(&picture, image.rgb.data(), 3 * image.width) &&
                     WebPAnimEncoderAdd(encoder_->animation, &picture, ms_, &encoder_->config);
  WebPPictureFree(&picture);
  if (!added) throw std::runtime_error("libwebp could not add a frame to the film");
  ms_ += ms_frame_;
}

void Film::write(const std::filesystem::path& path) {
  constexpr int last_image_ms = 1000;
  WebPAnimEncoderAdd(encoder_->animation, nullptr, ms_ + last_image_ms, nullptr);
  WebPData data;
  WebPDataInit(&data);
  const bool done = WebPAnimEncoderAssemble(encoder_->animation, &data);
  const std::string bytes(reinterpret_cast<const char*>(data.bytes), data.size);
  WebPDataClear(&data);
  if (!done) throw std::runtime_error(path.string() + ": libwebp could not make the film");
  io::write_file(path, bytes);
}

}  // namespace lazyccd::render
