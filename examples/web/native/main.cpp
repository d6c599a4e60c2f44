// Runs the scenes of the page natively, and prints a line of JSON for each scene and side: hashes
// of all positions, pass-throughs, and the median time of a step.
//
//   lazyccd_page_scenes [STEPS]     300 by default
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "demo.h"
#include "hash.h"

using namespace lazyccd;

int main(int count, char** arguments) {
  const int steps = count > 1 ? std::atoi(arguments[1]) : 300;
  for (const scenes::SceneInfo& info : web::page_scenes()) {
    for (const auto collisions : {scenes::Collisions::bullet, scenes::Collisions::lazyccd}) {
      web::Demo demo(info, collisions, info.speed, 1);
      std::vector<double> times;
      std::int64_t passed = 0;
      for (int step = 0; step < steps; ++step) {
        const auto start = std::chrono::steady_clock::now();
        demo.step();
        const std::chrono::duration<double, std::milli> ms =
            std::chrono::steady_clock::now() - start;
        times.push_back(ms.count());
        passed = demo.count();
      }
      std::nth_element(times.begin(), times.begin() + steps / 2, times.end());
      std::printf(
          "{\"scene\": \"%s\", \"with_lazyccd\": %s, \"passed\": %lld, \"ms\": %.4g, "
          "\"positions\": \"%08x\"}\n",
          info.name.c_str(), collisions == scenes::Collisions::lazyccd ? "true" : "false",
          static_cast<long long>(passed), times[static_cast<std::size_t>(steps / 2)],
          web::hash_of_positions(demo));
    }
  }
}
