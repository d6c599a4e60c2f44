// Fuzzes the PLY reader with arbitrary bytes. It must return a usable mesh or throw an Error with a
// message.
//
//   cmake -B build/fuzz -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DLAZYCCD_FUZZ=ON \
//         -DLAZYCCD_SANITIZE=address,undefined
//   cmake --build build/fuzz --target fuzz_ply
//   build/fuzz/tests/fuzz/fuzz_ply -max_len=1000 -max_total_time=600 \
//         NEW_INPUTS_DIR tests/fuzz/seeds/ply
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "io/ply.h"
#include "lazyccd/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lazyccd;
  try {
    const io::Mesh mesh =
        io::parse_ply(std::string_view(reinterpret_cast<const char*>(data), size), "input");
    for (const auto& vertex : mesh.vertices)
      for (const double x : vertex)
        if (!std::isfinite(x)) std::abort();
    for (const Face& face : mesh.faces)
      for (const std::int32_t index : face)
        if (index < 0 || static_cast<std::size_t>(index) >= mesh.vertices.size()) std::abort();
  } catch (const Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
