#include "io/file.h"

#include <cerrno>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <system_error>

#include "lazyccd/error.h"

namespace lazyccd::io {

namespace {

std::string last_system_error() { return std::generic_category().message(errno); }

}  // namespace

std::string read_file(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) fail(path.string(), "is a folder, not a file");
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(path.string(), "cannot be opened: " + last_system_error());
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  if (stream.bad()) fail(path.string(), "cannot be read: " + last_system_error());
  std::string result = std::move(bytes).str();
  if (result.empty()) fail(path.string(), "is empty");
  return result;
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  errno = 0;
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  if (!stream) fail(path.string(), "cannot be opened for writing: " + last_system_error());
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) fail(path.string(), "cannot be written: " + last_system_error());
}

void fail(const std::string& name, const std::string& what, std::ptrdiff_t item) {
  throw Error(ErrorCode::file, name + ": " + what, -1, static_cast<std::int32_t>(item));
}

void fail_at_line(const std::string& name, std::size_t line, const std::string& what,
                  std::ptrdiff_t item) {
  fail(name, "line " + std::to_string(line) + ": " + what, item);
}

void fail_at_byte(const std::string& name, std::size_t byte, const std::string& what,
                  std::ptrdiff_t item) {
  fail(name, "byte " + std::to_string(byte) + ": " + what, item);
}

std::string quoted(std::string_view text) {
  constexpr std::size_t max_length = 40;
  std::string result = "'";
  for (const char c : text.substr(0, max_length)) {
    const auto code = static_cast<unsigned char>(c);
    result += code < 0x20 || code > 0x7e ? '?' : c;
  }
  if (text.size() > max_length) result += "...";
  return result + "'";
}

}  // namespace lazyccd::io
