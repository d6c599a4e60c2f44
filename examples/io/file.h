// Reads and writes whole files. Errors name the file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace lazyccd::io {

/// Returns all bytes of a file. Throws Error(file) if it cannot be read or is empty.
std::string read_file(const std::filesystem::path& path);

/// Writes or replaces a file. Throws Error(file) if not every byte was written.
void write_file(const std::filesystem::path& path, std::string_view bytes);

// These three throw Error(file) with "name: what", "name: line 3: what" or "name: byte 3: what".
// `item` is the index of the vertex, face or query at fault, or -1.
[[noreturn]] void fail(const std::string& name, const std::string& what, std::ptrdiff_t item = -1);
[[noreturn]] void fail_at_line(const std::string& name, std::size_t line, const std::string& what,
                               std::ptrdiff_t item = -1);
[[noreturn]] void fail_at_byte(const std::string& name, std::size_t byte, const std::string& what,
                               std::ptrdiff_t item = -1);

/// Returns text of a file in quotes, for a message: at most 40 characters, and `?` in place of
/// every character that is not printable ASCII.
std::string quoted(std::string_view text);

}  // namespace lazyccd::io
