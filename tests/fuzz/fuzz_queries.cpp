// Fuzzes the readers of query files with arbitrary bytes. They must return finite queries or throw
// an Error with a message. The first byte selects the format.
//
//   cmake -B build/fuzz -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DLAZYCCD_FUZZ=ON \
//         -DLAZYCCD_SANITIZE=address,undefined
//   cmake --build build/fuzz --target fuzz_queries
//   build/fuzz/tests/fuzz/fuzz_queries -max_len=1000 -max_total_time=600 \
//         NEW_INPUTS_DIR tests/fuzz/seeds/queries
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "io/queries.h"
#include "lazyccd/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lazyccd;
  if (size == 0) return 0;
  const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const io::QueryFile file = data[0] == 'c' ? io::parse_queries_csv(rest, "input")
                                              : io::parse_queries_bin(rest, "input");
    if (!file.truth.empty() && file.truth.size() != file.points.size()) std::abort();
    for (const QueryPoints& points : file.points)
      for (const auto& point : points)
        for (const double x : point)
          if (!std::isfinite(x)) std::abort();
  } catch (const Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
