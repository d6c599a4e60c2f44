#include "io/ply.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>

#include "io/file.h"
#include "io/ply_header.h"
#include "io/text.h"

namespace lazyccd::io {

namespace {

bool host_is_little_endian() {
  const std::uint16_t one = 1;
  unsigned char first;
  std::memcpy(&first, &one, 1);
  return first == 1;
}

bool is_byte_swapped(PlyFormat format) {
  return (format == PlyFormat::binary_little_endian) != host_is_little_endian();
}

// Reads the values of the elements one after the other. A double holds every type of PLY exactly.
class Values {
 public:
  virtual ~Values() = default;
  virtual void begin_element() = 0;
  virtual double next(PlyType type) = 0;
  virtual void end_element() = 0;
  virtual void end_file() = 0;
  [[noreturn]] virtual void fail_here(const std::string& what, std::ptrdiff_t item) = 0;
};

template <class Number>
double number_at(const char* bytes) {
  Number value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

// Reads binary files.
class BinaryValues : public Values {
 public:
  BinaryValues(std::string_view bytes, std::size_t start, bool swapped, const std::string& name)
      : bytes_(bytes), at_(start), swapped_(swapped), name_(name) {}

  void begin_element() override { element_start_ = at_; }
  void end_element() override {}

  double next(PlyType type) override {
    const std::size_t size = size_of(type);
    if (bytes_.size() - at_ < size) {
      fail_at_byte(name_, bytes_.size(), "the file is cut short: it ends inside its data");
    }
    char value[8];
    for (std::size_t i = 0; i < size; ++i) value[i] = bytes_[at_ + (swapped_ ? size - 1 - i : i)];
    at_ += size;
    switch (type) {
      case PlyType::int8:
        return number_at<std::int8_t>(value);
      case PlyType::uint8:
        return number_at<std::uint8_t>(value);
      case PlyType::int16:
        return number_at<std::int16_t>(value);
      case PlyType::uint16:
        return number_at<std::uint16_t>(value);
      case PlyType::int32:
        return number_at<std::int32_t>(value);
      case PlyType::uint32:
        return number_at<std::uint32_t>(value);
      case PlyType::float32:
        return number_at<float>(value);
      case PlyType::float64:
        break;
    }
    return number_at<double>(value);
  }

  void end_file() override {
    if (at_ == bytes_.size()) return;
    fail_at_byte(name_, at_, "the file goes on after its last element");
  }

  [[noreturn]] void fail_here(const std::string& what, std::ptrdiff_t item) override {
    fail_at_byte(name_, element_start_, what, item);
  }

 private:
  std::string_view bytes_;
  std::size_t at_;
  std::size_t element_start_ = 0;
  bool swapped_;
  const std::string& name_;
};

bool in_range(std::int64_t value, PlyType type) {
  const bool is_signed = type == PlyType::int8 || type == PlyType::int16 || type == PlyType::int32;
  const std::int64_t count = std::int64_t{1} << (8 * size_of(type));
  return is_signed ? -count / 2 <= value && value < count / 2 : 0 <= value && value < count;
}

// Reads ASCII files: one element a line. Skips blank lines.
class AsciiValues : public Values {
 public:
  AsciiValues(std::string_view bytes, const PlyHeader& header, const std::string& name)
      : lines_(bytes.substr(header.bytes)), header_lines_(header.lines), name_(name) {}

  void begin_element() override {
    if (!next_line()) fail_here("the file is cut short: expected another element", -1);
  }

  double next(PlyType type) override {
    if (used_ == words_.size()) fail_here("the line ends where another value should be", -1);
    const std::string_view word = words_[used_++];
    std::optional<double> value;
    if (is_integer(type)) {
      const std::optional<std::int64_t> whole = to_number<std::int64_t>(word);
      if (whole && in_range(*whole, type)) value = static_cast<double>(*whole);
    } else if (type == PlyType::float32) {
      value = to_number<float>(word);
    } else {
      value = to_number<double>(word);
    }
    if (!value) {
      fail_here(std::string("expected a ") + (is_integer(type) ? "whole " : "") +
                    "number of its type, found " + quoted(word),
                -1);
    }
    return *value;
  }

  void end_element() override {
    if (used_ < words_.size()) {
      fail_here("expected the end of the line, found " + quoted(words_[used_]), -1);
    }
  }

  void end_file() override {
    if (next_line()) fail_here("the file goes on after its last element", -1);
  }

  [[noreturn]] void fail_here(const std::string& what, std::ptrdiff_t item) override {
    fail_at_line(name_, header_lines_ + lines_.line(), what, item);
  }

 private:
  bool next_line() {
    used_ = 0;
    while (const std::optional<std::string_view> line = lines_.next()) {
      words_ = words(*line);
      if (!words_.empty()) return true;
    }
    return false;
  }

  LineReader lines_;
  std::size_t header_lines_;
  const std::string& name_;
  std::vector<std::string_view> words_;
  std::size_t used_ = 0;
};

// Builds a mesh from the elements of a file.
class MeshReader {
 public:
  MeshReader(Values& values, const std::string& name) : values_(values), name_(name) {}

  Mesh read(const PlyHeader& header) {
    for (const PlyElement& element : header.elements) {
      if (element.properties.empty()) continue;  // takes no space in the file
      if (element.name == "vertex") {
        read_vertices(element);
      } else if (element.name == "face") {
        read_faces(element);
      } else {
        for (std::size_t i = 0; i < element.count; ++i) {
          values_.begin_element();
          for (const PlyProperty& property : element.properties) skip(property);
          values_.end_element();
        }
      }
    }
    values_.end_file();
    if (mesh_.vertices.empty()) fail(name_, "holds no vertices");
    if (mesh_.faces.empty()) fail(name_, "holds no faces");
    check_indices();
    return std::move(mesh_);
  }

 private:
  void read_vertices(const PlyElement& element) {
    static constexpr std::string_view axis_names[] = {"x", "y", "z"};
    std::vector<int> axis_of(element.properties.size(), -1);
    for (int axis = 0; axis < 3; ++axis) {
      bool found = false;
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (property.name != axis_names[axis] || property.count_type) continue;
        axis_of[p] = axis;
        found = true;
      }
      if (!found) fail(name_, "element vertex has no property " + std::string(axis_names[axis]));
    }
    if (element.count > std::numeric_limits<std::int32_t>::max()) {
      fail(name_, "has more vertices than a 32-bit index can number");
    }
    for (std::size_t i = 0; i < element.count; ++i) {
      std::array<double, 3> vertex{};
      values_.begin_element();
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        if (axis_of[p] < 0) {
          skip(element.properties[p]);
        } else {
          vertex[static_cast<std::size_t>(axis_of[p])] = values_.next(element.properties[p].type);
        }
      }
      for (const double x : vertex) {
        if (!std::isfinite(x)) {
          values_.fail_here("vertex " + std::to_string(i) + " is not finite",
                            static_cast<std::ptrdiff_t>(i));
        }
      }
      values_.end_element();
      mesh_.vertices.push_back(vertex);
    }
  }

  void read_faces(const PlyElement& element) {
    bool found = false;
    for (const PlyProperty& property : element.properties) found |= is_corner_list(property);
    if (!found) fail(name_, "element face has no list vertex_indices of a whole-number type");
    for (std::size_t i = 0; i < element.count; ++i) {
      values_.begin_element();
      for (const PlyProperty& property : element.properties) {
        if (is_corner_list(property)) {
          mesh_.faces.push_back(read_corners(property, i));
        } else {
          skip(property);
        }
      }
      values_.end_element();
    }
  }

  static bool is_corner_list(const PlyProperty& property) {
    return (property.name == "vertex_indices" || property.name == "vertex_index") &&
           property.count_type && is_integer(property.type);
  }

  Face read_corners(const PlyProperty& property, std::size_t index) {
    const double count = values_.next(*property.count_type);
    if (count != 3) {
      values_.fail_here("face " + std::to_string(index) + " has " +
                            std::to_string(static_cast<std::int64_t>(count)) +
                            " corners; only triangles are accepted",
                        static_cast<std::ptrdiff_t>(index));
    }
    Face face;
    for (std::int32_t& corner : face) {
      const double value = values_.next(property.type);
      if (!(value >= 0 && value <= std::numeric_limits<std::int32_t>::max())) {
        values_.fail_here("face " + std::to_string(index) + " names vertex " +
                              std::to_string(static_cast<std::int64_t>(value)) +
                              ", which cannot exist",
                          static_cast<std::ptrdiff_t>(index));
      }
      corner = static_cast<std::int32_t>(value);
    }
    return face;
  }

  void skip(const PlyProperty& property) {
    if (!property.count_type) {
      values_.next(property.type);
      return;
    }
    const double count = values_.next(*property.count_type);
    if (count < 0) values_.fail_here("a list of negative length", -1);
    for (double i = 0; i < count; ++i) values_.next(property.type);
  }

  // Runs at the end, because the faces may come before the vertices.
  void check_indices() {
    for (std::size_t i = 0; i < mesh_.faces.size(); ++i) {
      for (const std::int32_t corner : mesh_.faces[i]) {
        if (static_cast<std::size_t>(corner) < mesh_.vertices.size()) continue;
        fail(name_,
             "face " + std::to_string(i) + " names vertex " + std::to_string(corner) +
                 ", but there are only " + std::to_string(mesh_.vertices.size()) + " vertices",
             static_cast<std::ptrdiff_t>(i));
      }
    }
  }

  Values& values_;
  const std::string& name_;
  Mesh mesh_;
};

template <class Number>
void append_binary(std::string& bytes, Number value, bool swapped) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    bytes += raw[swapped ? sizeof(Number) - 1 - i : i];
  }
}

template <class Number>
void append_ascii(std::string& bytes, Number value) {
  char text[32];
#if defined(__cpp_lib_to_chars)
  bytes.append(text, std::to_chars(text, text + sizeof(text), value).ptr);
#else
  // So many digits read back as the same number.
  std::snprintf(text, sizeof(text), "%.*g", std::numeric_limits<Number>::max_digits10,
                static_cast<double>(value));
  bytes += text;
#endif
}

std::string header_of(const Mesh& mesh, PlyFormat format, PlyScalar scalar) {
  const char* format_name = format == PlyFormat::ascii                  ? "ascii"
                            : format == PlyFormat::binary_little_endian ? "binary_little_endian"
                                                                        : "binary_big_endian";
  const std::string type = scalar == PlyScalar::float32 ? "float" : "double";
  return std::string("ply\nformat ") + format_name + " 1.0\nelement vertex " +
         std::to_string(mesh.vertices.size()) + "\nproperty " + type + " x\nproperty " + type +
         " y\nproperty " + type + " z\nelement face " + std::to_string(mesh.faces.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

}  // namespace

Mesh parse_ply(std::string_view bytes, const std::string& name) {
  const PlyHeader header = parse_ply_header(bytes, name);
  if (header.format == PlyFormat::ascii) {
    AsciiValues values(bytes, header, name);
    return MeshReader(values, name).read(header);
  }
  BinaryValues values(bytes, header.bytes, is_byte_swapped(header.format), name);
  return MeshReader(values, name).read(header);
}

Mesh read_ply(const std::filesystem::path& path) {
  return parse_ply(read_file(path), path.string());
}

void write_ply(const std::filesystem::path& path, const Mesh& mesh, PlyFormat format,
               PlyScalar scalar) {
  std::string bytes = header_of(mesh, format, scalar);
  const bool ascii = format == PlyFormat::ascii;
  const bool swapped = is_byte_swapped(format);
  const auto append = [&](auto value, char separator) {
    if (ascii) {
      append_ascii(bytes, value);
      bytes += separator;
    } else {
      append_binary(bytes, value, swapped);
    }
  };
  for (const std::array<double, 3>& vertex : mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const char separator = axis < 2 ? ' ' : '\n';
      if (scalar == PlyScalar::float32) {
        append(static_cast<float>(vertex[axis]), separator);
      } else {
        append(vertex[axis], separator);
      }
    }
  }
  for (const Face& face : mesh.faces) {
    append(std::uint8_t{3}, ' ');
    for (std::size_t corner = 0; corner < 3; ++corner) {
      append(face[corner], corner < 2 ? ' ' : '\n');
    }
  }
  write_file(path, bytes);
}

}  // namespace lazyccd::io
