// Runs starts at a distance of zero or nearly so, with LazyCCD and with Bullet alone, and prints
// what is wrong with LazyCCD's.
//
//   lazyccd_touching_starts --from 1 --count 20000
//
// Exit code 1 if anything is. A fault is one of these:
//   NOT FINITE  a position, and not with Bullet alone
//   FELL        a node is below what it started on
//   STICKS      an edge passes through a face, and none does so with Bullet alone
//   FAST        a node is faster than 1.3 times Bullet's fastest plus 0.3 m/s
//   ENERGY      more was gained than with Bullet, by over 1 % of the energy of the scene
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "random/touching_start.h"

using namespace lazyccd;

namespace {

std::string sentence(const test::StartReport& start, const test::StartReport& alone) {
  char text[300];
  std::snprintf(
      text, sizeof text,
      "fell %d, %d; piercing %lld, %lld; fastest %.3g, %.3g m/s; gained %.3g, %.3g of %.3g J",
      start.fallen, alone.fallen, static_cast<long long>(start.piercing),
      static_cast<long long>(alone.piercing), start.fastest, alone.fastest, start.gained,
      alone.gained, start.scale);
  return text;
}

scenes::World world_of(std::uint32_t number) {
  return number % 2 == 0 ? scenes::World::rigid : scenes::World::deformable;
}

// Runs a start with Bullet alone in a child process, because it may crash or not end. False if it
// does; then no position is finite.
bool run_alone(std::uint32_t number, test::StartReport& alone) {
  struct Figures {
    double fastest, gained;
    std::int64_t piercing;
    int fallen;
    bool is_finite;
  } figures = {};
  int ends[2];
  if (pipe(ends) != 0) return false;
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    constexpr unsigned timeout = 30;  // seconds
    alarm(timeout);
    const test::StartReport r =
        test::run_touching_start(number, world_of(number), scenes::Collisions::bullet);
    figures = {r.fastest, r.gained, r.piercing, r.fallen, r.is_finite};
    _exit(write(ends[1], &figures, sizeof figures) == sizeof figures ? EXIT_SUCCESS : EXIT_FAILURE);
  }
  close(ends[1]);
  const bool is_read = read(ends[0], &figures, sizeof figures) == sizeof figures;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  alone.is_finite = is_read && figures.is_finite;
  alone.fastest = figures.fastest;
  alone.gained = figures.gained;
  alone.piercing = figures.piercing;
  alone.fallen = figures.fallen;
  return is_read;
}

// Returns the faults of a start, and prints it if it has any.
std::string run(std::uint32_t number, bool all) {
  test::StartReport alone;
  run_alone(number, alone);
  const test::StartReport start =
      test::run_touching_start(number, world_of(number), scenes::Collisions::lazyccd);
  const std::string fault = test::faults_of(start, alone);
  if (!fault.empty() || all)
    std::printf("%u:%s | %s | %s, %s\n", number, fault.c_str(), sentence(start, alone).c_str(),
                world_of(number) == scenes::World::rigid ? "rigid" : "deformable",
                start.what.c_str());
  std::fflush(stdout);
  return fault;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Starts at a distance of zero");
  std::uint32_t from = 1, count = 200;
  bool all = false;
  app.add_option("--from", from);
  app.add_option("--count", count);
  app.add_flag("--all", all, "prints every start");
  CLI11_PARSE(app, argc, argv);
  std::map<std::string, int> faults;
  for (std::uint32_t number = from; number < from + count; ++number) {
    const std::string fault = run(number, all);
    if (!fault.empty()) ++faults[fault];
  }
  for (const auto& [fault, times] : faults) std::printf("%d starts:%s\n", times, fault.c_str());
  std::printf("%u starts\n", count);
  return faults.empty() ? EXIT_SUCCESS : EXIT_FAILURE;
}
