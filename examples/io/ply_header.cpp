#include "io/ply_header.h"

#include <utility>

#include "io/file.h"
#include "io/text.h"

namespace lazyccd::io {

namespace {

std::optional<PlyType> type_of(std::string_view word) {
  static constexpr std::pair<std::string_view, PlyType> names[] = {
      {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
      {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
      {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
      {"float64", PlyType::float64}};
  for (const auto& [name, type] : names) {
    if (name == word) return type;
  }
  return std::nullopt;
}

class HeaderParser {
 public:
  HeaderParser(std::string_view bytes, const std::string& name) : lines_(bytes), name_(name) {}

  PlyHeader parse() {
    if (next("'ply'") != "ply") fail_here("expected 'ply': this is not a PLY file");
    PlyHeader header;
    header.format = format(words(next("the format")));
    for (;;) {
      const std::string_view line = next("'end_header'");
      const std::vector<std::string_view> word = words(line);
      if (word.empty() || word[0] == "comment" || word[0] == "obj_info") continue;
      if (word[0] == "end_header") break;
      if (word[0] == "element") {
        header.elements.push_back(element(word));
      } else if (word[0] == "property") {
        if (header.elements.empty()) fail_here("a property before the first element");
        header.elements.back().properties.push_back(property(word));
      } else {
        fail_here("expected element, property, comment or end_header, found " + quoted(line));
      }
    }
    header.bytes = lines_.byte();
    header.lines = lines_.line();
    return header;
  }

 private:
  std::string_view next(const char* expected) {
    const std::optional<std::string_view> line = lines_.next();
    if (!line) {
      fail_at_line(name_, lines_.line() + 1, std::string("the file ends before ") + expected);
    }
    return *line;
  }

  PlyFormat format(const std::vector<std::string_view>& word) {
    if (word.size() == 3 && word[0] == "format" && word[2] == "1.0") {
      if (word[1] == "ascii") return PlyFormat::ascii;
      if (word[1] == "binary_little_endian") return PlyFormat::binary_little_endian;
      if (word[1] == "binary_big_endian") return PlyFormat::binary_big_endian;
    }
    fail_here("expected 'format' ascii, binary_little_endian or binary_big_endian '1.0'");
  }

  PlyElement element(const std::vector<std::string_view>& word) {
    const std::optional<std::size_t> count =
        word.size() == 3 ? to_number<std::size_t>(word[2]) : std::nullopt;
    if (!count) fail_here("expected 'element', a name and a count");
    return {std::string(word[1]), *count, {}};
  }

  PlyProperty property(const std::vector<std::string_view>& word) {
    if (word.size() == 3) {
      if (const auto type = type_of(word[1])) return {std::string(word[2]), *type, std::nullopt};
    } else if (word.size() == 5 && word[1] == "list") {
      const auto count_type = type_of(word[2]), type = type_of(word[3]);
      if (type && count_type && is_integer(*count_type)) {
        return {std::string(word[4]), *type, count_type};
      }
    }
    fail_here("expected 'property', a type and a name, or 'property list', two types and a name");
  }

  [[noreturn]] void fail_here(const std::string& what) { fail_at_line(name_, lines_.line(), what); }

  LineReader lines_;
  const std::string& name_;
};

}  // namespace

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      break;
  }
  return 8;
}

PlyHeader parse_ply_header(std::string_view bytes, const std::string& name) {
  return HeaderParser(bytes, name).parse();
}

}  // namespace lazyccd::io
