// Whole files in and out, with errors that name the file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace lazyccd::io {

// All bytes of a file. Throws Error (file) where it cannot be read or holds none.
std::string read_file(const std::filesystem::path& path);

// Replaces a file. Throws Error (file) where not every byte reached it.
void write_file(const std::filesystem::path& path, std::string_view bytes);

// "name: line 3: what" and "name: byte 3: what"; `item` is the index of the vertex, face or query
// at fault, or -1.
[[noreturn]] void fail(const std::string& name, const std::string& what, std::ptrdiff_t item = -1);
[[noreturn]] void fail_at_line(const std::string& name, std::size_t line, const std::string& what,
                               std::ptrdiff_t item = -1);
[[noreturn]] void fail_at_byte(const std::string& name, std::size_t byte, const std::string& what,
                               std::ptrdiff_t item = -1);

// Text of a file, quoted for a message: shortened, without control characters.
std::string quoted(std::string_view text);

}  // namespace lazyccd::io
