#include "io/queries.h"

#include <cmath>
#include <cstring>
#include <optional>

#include "io/file.h"
#include "io/rational.h"
#include "io/text.h"

namespace lazyccd::io {

namespace {

constexpr std::size_t rows_per_query = 8;

// Splits a line at its commas and removes spaces around the fields.
std::vector<std::string_view> fields(std::string_view line) {
  std::vector<std::string_view> result;
  for (std::size_t at = 0;;) {
    const std::size_t comma = line.find(',', at);
    std::string_view field = line.substr(at, comma - at);
    const std::size_t first = field.find_first_not_of(' ');
    field.remove_prefix(first == std::string_view::npos ? field.size() : first);
    while (!field.empty() && field.back() == ' ') field.remove_suffix(1);
    result.push_back(field);
    if (comma == std::string_view::npos) return result;
    at = comma + 1;
  }
}

class CsvParser {
 public:
  CsvParser(std::string_view text, const std::string& name) : lines_(text), name_(name) {}

  QueryFile parse() {
    while (const std::optional<std::string_view> line = lines_.next()) {
      if (words(*line).empty()) continue;
      parse_row(fields(*line));
    }
    if (rows_ == 0) fail(name_, "holds no queries");
    if (rows_ % rows_per_query != 0) {
      fail_here("the file is cut short: the last query has " +
                std::to_string(rows_ % rows_per_query) + " of 8 rows");
    }
    return std::move(file_);
  }

 private:
  void parse_row(const std::vector<std::string_view>& columns) {
    if (rows_ == 0) columns_ = columns.size();
    if (columns_ != 6 && columns_ != 7) {
      fail_here(
          "expected 6 columns (numerators and denominators of x, y, z) or 7 (with the truth), "
          "found " +
          std::to_string(columns_));
    }
    if (columns.size() != columns_) {
      fail_here("expected " + std::to_string(columns_) + " columns as in the first row, found " +
                std::to_string(columns.size()));
    }
    const std::size_t row = rows_++ % rows_per_query;
    if (row == 0) file_.points.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      file_.points.back()[row][axis] = coordinate(columns[2 * axis], columns[2 * axis + 1]);
    }
    if (columns_ == 7) parse_truth(columns[6], row);
  }

  double coordinate(std::string_view numerator, std::string_view denominator) {
    RoundedRational result{};
    switch (to_double(numerator, denominator, result)) {
      case RationalError::none:
        break;
      case RationalError::not_a_number:
        fail_here("expected two whole numbers, found " + quoted(numerator) + " and " +
                  quoted(denominator));
      case RationalError::zero_denominator:
        fail_here("a denominator is zero");
      case RationalError::out_of_range:
        fail_here("a coordinate is too large for a double");
    }
    if (!result.exact) ++file_.rounded;
    return result.value;
  }

  void parse_truth(std::string_view field, std::size_t row) {
    if (field != "0" && field != "1") {
      fail_here("expected the truth, 0 or 1, found " + quoted(field));
    }
    const std::uint8_t truth = field == "1" ? 1 : 0;
    if (row == 0) {
      file_.truth.push_back(truth);
    } else if (file_.truth.back() != truth) {
      fail_here("the truth differs from that of the query's first row");
    }
  }

  [[noreturn]] void fail_here(const std::string& what) {
    fail_at_line(name_, lines_.line(), what, static_cast<std::ptrdiff_t>(file_.points.size()) - 1);
  }

  LineReader lines_;
  const std::string& name_;
  QueryFile file_;
  std::size_t rows_ = 0;
  std::size_t columns_ = 0;
};

std::uint64_t little_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) {
    value = value << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

}  // namespace

QueryFile parse_queries_csv(std::string_view text, const std::string& name) {
  return CsvParser(text, name).parse();
}

QueryFile parse_queries_bin(std::string_view bytes, const std::string& name) {
  constexpr std::size_t header = 4, coordinates = 24, per_query = coordinates * 8 + 1;
  if (bytes.size() < header)
    fail(name, "expected the number of queries, found the end of the file");
  const auto count = static_cast<std::int32_t>(little_endian(bytes.substr(0, header)));
  if (count <= 0)
    fail_at_byte(name, 0, "expected the number of queries, found " + std::to_string(count));
  const auto n = static_cast<std::size_t>(count);
  const std::size_t expected = header + n * per_query;
  if (bytes.size() != expected) {
    fail_at_byte(
        name, bytes.size(),
        std::string(bytes.size() < expected ? "the file is cut short" : "the file is too long") +
            ": " + std::to_string(n) + " queries take " + std::to_string(expected) + " bytes");
  }

  QueryFile file;
  file.points.resize(n);
  for (std::size_t i = 0; i < n * coordinates; ++i) {
    const std::size_t at = header + 8 * i;
    const std::uint64_t bits = little_endian(bytes.substr(at, 8));
    double value;
    std::memcpy(&value, &bits, sizeof(value));
    const std::size_t query = i / coordinates;
    if (!std::isfinite(value)) {
      fail_at_byte(name, at,
                   "query " + std::to_string(query) + " has a coordinate that is not finite",
                   static_cast<std::ptrdiff_t>(query));
    }
    file.points[query][i % coordinates / 3][i % 3] = value;
  }
  file.truth.resize(n);
  for (std::size_t query = 0; query < n; ++query) {
    const std::size_t at = header + 8 * coordinates * n + query;
    const auto truth = static_cast<std::uint8_t>(bytes[at]);
    if (truth > 1) {
      fail_at_byte(name, at, "expected the truth, 0 or 1, found " + std::to_string(truth),
                   static_cast<std::ptrdiff_t>(query));
    }
    file.truth[query] = truth;
  }
  return file;
}

QueryFile read_queries(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::string ending = path.extension().string();
  if (ending == ".csv") return parse_queries_csv(read_file(path), name);
  if (ending == ".bin") return parse_queries_bin(read_file(path), name);
  fail(name, "expected a file name that ends in .csv or .bin");
}

}  // namespace lazyccd::io
