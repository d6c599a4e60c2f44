#include <cmath>
#include <cstring>
#include <limits>

#include "io/file.h"
#include "io/queries.h"
#include "io/rational.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/temporary.h"

using namespace lazyccd;
using namespace lazyccd::io;
using Matchers::ContainsSubstring;

namespace {

std::string rows(const std::string& row, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += row + "\n";
  return text;
}

std::string csv_error(const std::string& text) {
  try {
    parse_queries_csv(text, "q.csv");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::file);
    return error.what();
  }
  return "no error";
}

std::string bin_error(const std::string& bytes) {
  try {
    parse_queries_bin(bytes, "q.bin");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::file);
    return error.what();
  }
  return "no error";
}

// One query with the points (0, 1, 2), (3, 4, 5), ... and a true answer. Little-endian hosts only.
std::string sample_bin() {
  const std::int32_t count = 1;
  std::string bytes(reinterpret_cast<const char*>(&count), sizeof(count));
  for (int i = 0; i < 24; ++i) {
    const double value = i;
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  return bytes + '\1';
}

RoundedRational rational(const std::string& numerator, const std::string& denominator) {
  RoundedRational result{};
  CHECK(to_double(numerator, denominator, result) == RationalError::none);
  return result;
}

RationalError rational_error(const std::string& numerator, const std::string& denominator) {
  RoundedRational result{};
  return to_double(numerator, denominator, result);
}

// 2^exponent in decimal digits.
std::string power_of_two(int exponent) {
  std::string digits = "1";
  for (int i = 0; i < exponent; ++i) {
    int carry = 0;
    for (std::size_t d = digits.size(); d-- > 0;) {
      const int doubled = 2 * (digits[d] - '0') + carry;
      digits[d] = static_cast<char>('0' + doubled % 10);
      carry = doubled / 10;
    }
    if (carry) digits.insert(digits.begin(), '1');
  }
  return digits;
}

}  // namespace

TEST_CASE("a rational that is exact in double precision is converted without rounding") {
  CHECK(rational("3", "4").value == 0.75);
  CHECK(rational("-3", "4").value == -0.75);
  CHECK(rational("3", "-4").value == -0.75);
  CHECK(rational("+6", "8").value == 0.75);
  CHECK(rational("007", "1").value == 7);
  CHECK(rational("0", "-5").value == 0);
  CHECK(rational("9007199254740993", "9007199254740993").exact);
  CHECK(rational("-5936450128420645", "649037107316853453566312041152512").value ==
        std::ldexp(-5936450128420645.0, -109));
  CHECK(rational("1", power_of_two(1074)).value == std::numeric_limits<double>::denorm_min());
  CHECK(rational("1", power_of_two(1074)).exact);
  CHECK(rational(power_of_two(1023), "1").value == std::ldexp(1.0, 1023));
}

TEST_CASE("a rational that is not exact in double precision is rounded half to even and flagged") {
  CHECK(rational("1", "3").value == 1.0 / 3);
  CHECK_FALSE(rational("1", "3").exact);
  CHECK(rational("-2", "3").value == -2.0 / 3);
  CHECK(rational("9007199254740993", "1").value == 9007199254740992.0);
  CHECK(rational("9007199254740995", "1").value == 9007199254740996.0);
  CHECK_FALSE(rational("9007199254740993", "1").exact);
  CHECK(rational("18014398509481983", "2").value == 9007199254740992.0);
  CHECK(rational("3", power_of_two(1075)).value == std::ldexp(2.0, -1074));
  CHECK(rational("1", power_of_two(1075)).value == 0);
  CHECK_FALSE(rational("1", power_of_two(1075)).exact);
}

TEST_CASE("text that is no rational in the range of double precision is refused") {
  CHECK(rational_error("", "1") == RationalError::not_a_number);
  CHECK(rational_error("1.5", "1") == RationalError::not_a_number);
  CHECK(rational_error("nan", "1") == RationalError::not_a_number);
  CHECK(rational_error("1", "0x2") == RationalError::not_a_number);
  CHECK(rational_error("-", "1") == RationalError::not_a_number);
  CHECK(rational_error(std::string(2001, '1'), "1") == RationalError::not_a_number);
  CHECK(rational_error("1", "-0") == RationalError::zero_denominator);
  CHECK(rational_error(power_of_two(1024), "1") == RationalError::out_of_range);
}

TEST_CASE("a query file of six columns has no truth, one of seven has") {
  const QueryFile without = parse_queries_csv(rows("1,2,3,4,-5,8", 8), "q.csv");
  REQUIRE(without.points.size() == 1);
  CHECK(without.truth.empty());
  CHECK(without.rounded == 0);
  for (const auto& point : without.points[0])
    CHECK(point == std::array<double, 3>{0.5, 0.75, -0.625});

  const QueryFile with = parse_queries_csv(
      rows("1,2,3,4,5,8,1", 8) + "\r\n" + rows("0,1, 0 ,1,1,3,0\r", 8) + "\n", "q.csv");
  CHECK(with.points.size() == 2);
  CHECK(with.truth == std::vector<std::uint8_t>{1, 0});
  CHECK(with.rounded == 8);
}

TEST_CASE("errors in a query file of text name the line and what was expected") {
  CHECK_THAT(csv_error("\n\n"), ContainsSubstring("holds no queries"));
  CHECK_THAT(csv_error(rows("1,1,1,1,1,1,0", 15)),
             ContainsSubstring("line 15: the file is cut short: the last query has 7 of 8"));
  CHECK_THAT(csv_error("1,1,1,1,1\n"), ContainsSubstring("line 1: expected 6 columns"));
  CHECK_THAT(csv_error("ply\n"), ContainsSubstring("line 1: expected 6 columns"));
  CHECK_THAT(csv_error(rows("1,1,1,1,1,1,0", 3) + "1,1,1,1,1,1\n"),
             ContainsSubstring("line 4: expected 7 columns"));
  CHECK_THAT(csv_error(rows("1,1,1,1,1,1,0", 3) + "1,1,1,1,1,1,2\n"),
             ContainsSubstring("line 4: expected the truth, 0 or 1, found '2'"));
  CHECK_THAT(csv_error(rows("1,1,1,1,1,1,0", 3) + "1,1,1,1,1,1,1\n"),
             ContainsSubstring("line 4: the truth differs"));
  CHECK_THAT(csv_error("1,1,1,1,nan,1\n"),
             ContainsSubstring("line 1: expected two whole numbers, found 'nan' and '1'"));
  CHECK_THAT(csv_error("1,1,1,1,1,0\n"), ContainsSubstring("line 1: a denominator is zero"));
  CHECK_THAT(csv_error(power_of_two(1024) + ",1,1,1,1,1\n"),
             ContainsSubstring("line 1: a coordinate is too large"));
}

TEST_CASE("a binary query file reads in the order of its points") {
  const QueryFile file = parse_queries_bin(sample_bin(), "q.bin");
  REQUIRE(file.points.size() == 1);
  CHECK(file.truth == std::vector<std::uint8_t>{1});
  CHECK(file.points[0][0] == std::array<double, 3>{0, 1, 2});
  CHECK(file.points[0][7] == std::array<double, 3>{21, 22, 23});
}

TEST_CASE("errors in a binary query file name the byte and what was expected") {
  const std::string good = sample_bin();
  for (std::size_t length = 0; length < good.size(); ++length) {
    CHECK_THROWS_AS(parse_queries_bin(good.substr(0, length), "q.bin"), Error);
  }
  CHECK_THAT(bin_error(good.substr(0, 100)),
             ContainsSubstring("byte 100: the file is cut short: 1 queries take 197 bytes"));
  CHECK_THAT(bin_error(good + '\0'), ContainsSubstring("byte 198: the file is too long"));
  CHECK_THAT(bin_error(std::string(4, '\0')),
             ContainsSubstring("byte 0: expected the number of queries, found 0"));
  CHECK_THAT(bin_error(std::string(4, '\xff') + good), ContainsSubstring("found -1"));
  std::string bad = good;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(&bad[4 + 8 * 5], &nan, sizeof(nan));
  CHECK_THAT(bin_error(bad),
             ContainsSubstring("byte 44: query 0 has a coordinate that is not finite"));
  bad = good;
  bad.back() = 7;
  CHECK_THAT(bin_error(bad), ContainsSubstring("byte 196: expected the truth, 0 or 1, found 7"));
}

TEST_CASE("the file name extension selects the format of a query file") {
  const test::TemporaryFolder folder;
  write_file(folder / "q.csv", rows("1,2,3,4,5,8,1", 8));
  write_file(folder / "q.bin", sample_bin());
  write_file(folder / "q.txt", sample_bin());
  CHECK(read_queries(folder / "q.csv").points.size() == 1);
  CHECK(read_queries(folder / "q.bin").points.size() == 1);
  CHECK_THROWS_WITH(read_queries(folder / "q.txt"), ContainsSubstring("ends in .csv or .bin"));
}

TEST_CASE("every coordinate of the public query sets is exact in double precision") {
  const auto data = test::data_dir();
  if (!data) return;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(*data / "queries")) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("data_", 0) != 0 || entry.path().extension() != ".csv") continue;
    const QueryFile file = read_queries(entry.path());
    CAPTURE(entry.path().string());
    CHECK(file.rounded == 0);
    CHECK(file.truth.size() == file.points.size());
  }
}
