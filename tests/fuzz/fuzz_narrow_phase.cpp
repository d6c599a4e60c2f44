// Fuzzes the narrow phase with arbitrary bits. Numbers that are not finite must be refused. Other
// queries must be decided as exact arithmetic decides them, and the same backwards in time.
//
//   cmake -B build/fuzz -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DLAZYCCD_FUZZ=ON \
//         -DLAZYCCD_SANITIZE=address,undefined
//   cmake --build build/fuzz --target fuzz_narrow_phase
//   build/fuzz/tests/fuzz/fuzz_narrow_phase -max_len=193 -max_total_time=600 \
//         NEW_INPUTS_DIR tests/fuzz/seeds/narrow_phase
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "cpu/narrow/exact.h"
#include "lazyccd/error.h"
#include "lazyccd/query.h"

namespace {

using namespace lazyccd;

constexpr std::size_t coordinates = 24;

// Reads the coordinates; missing ones are zero. The first byte of the input, already removed,
// selects the kind and the number format. Small integers hit degenerate cases that random doubles
// never hit.
template <class Number>
QueryPoints read_points(const std::uint8_t* data, std::size_t size) {
  Number numbers[coordinates] = {};
  std::memcpy(numbers, data, std::min(size, sizeof numbers));
  QueryPoints points;
  for (std::size_t i = 0; i < coordinates; ++i)
    points[i / 3][i % 3] = static_cast<double>(numbers[i]);
  return points;
}

bool is_finite(const QueryPoints& points) {
  for (const auto& point : points)
    for (const double x : point)
      if (!std::isfinite(x)) return false;
  return true;
}

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const ContactKind kind = data[0] & 1 ? ContactKind::edge_edge : ContactKind::vertex_face;
  const int format = (data[0] >> 1) % 3;
  ++data, --size;
  const QueryPoints points = format == 0   ? read_points<double>(data, size)
                             : format == 1 ? read_points<float>(data, size)
                                           : read_points<std::int8_t>(data, size);
  if (!is_finite(points)) {
    bool refused = false;
    try {
      decide(kind, points);
    } catch (const Error& error) {
      refused = error.code() == ErrorCode::non_finite_position;
    }
    require(refused);
    return 0;
  }

  const QueryResult result = decide(kind, points);
  const QueryResult exact = decide_exact(kind, points);
  require(result.hit == exact.hit);
  if (result.hit) {
    require(result.toi == exact.toi);
    require(result.toi >= 0 && result.toi <= 1);
    require(std::ldexp(result.toi, 32) == std::floor(std::ldexp(result.toi, 32)));
  }
  QueryPoints back = points;
  std::rotate(back.begin(), back.begin() + 4, back.end());
  require(decide(kind, back).hit == result.hit);
  return 0;
}
