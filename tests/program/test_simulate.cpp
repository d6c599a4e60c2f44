// Tests the commands of the program lazyccd that need Bullet.
#include <nlohmann/json.hpp>

#include "io/file.h"
#include "io/ply.h"
#include "program/run_program.h"
#include "support/catch.h"

using namespace lazyccd;
using Matchers::ContainsSubstring;
using test::Outcome;
using test::run;

namespace {

nlohmann::json simulate(const std::string& arguments) {
  const test::TemporaryFolder folder;
  const std::string stats = (folder / "stats.json").string();
  const Outcome outcome = run(folder, "simulate " + arguments + " --stats " + stats);
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.err.empty());
  return nlohmann::json::parse(io::read_file(stats));
}

}  // namespace

TEST_CASE("scenes lists the scenes that simulate runs") {
  const test::TemporaryFolder folder;
  const Outcome outcome = run(folder, "scenes");
  CHECK(outcome.exit_code == 0);
  for (const char* scene : {"cloth-on-cloth", "small-triangles", "free-cloths", "cloth-on-mesh",
                            "edge-on-edge", "fold", "eight-cloths", "drop"}) {
    CHECK_THAT(outcome.out, ContainsSubstring(scene));
  }
}

TEST_CASE("simulate counts pass-throughs of Bullet alone and none with LazyCCD") {
  const std::string world = GENERATE("rigid", "deformable");
  const auto alone = simulate("edge-on-edge --speed 5 --detector bullet --world " + world);
  CHECK(alone["pass_throughs"]["edge_edge"].get<int>() > 0);
  CHECK(alone["nodes_on_wrong_side"] == 2);
  const auto with = simulate("edge-on-edge --speed 5 --detector lazyccd --world " + world);
  CHECK(with["pass_throughs"]["edge_edge"] == 0);
  CHECK(with["pass_throughs"]["vertex_face"] == 0);
  CHECK(with["nodes_on_wrong_side"] == 0);
  CHECK(with["contacts"]["edge_edge"].get<int>() > 0);
  CHECK(with["failsafe_holds"] == 0);
  CHECK(with["kinetic_energy_J"].size() == with["steps"]);
  for (const char* part : {"total", "bullet", "gather", "detect", "response", "write"}) {
    CHECK(with["ms_per_step"][part].is_number());
    CHECK(with["median_ms_per_step"][part].is_number());
  }
}

TEST_CASE("simulate writes the frames it was asked for") {
  const test::TemporaryFolder folder;
  const Outcome outcome =
      run(folder, "simulate cloth-on-cloth --size 0.2 --steps 5 --every 2 --out " +
                      (folder / "frames").string());
  CHECK(outcome.exit_code == 0);
  for (const char* name : {"00000.ply", "00002.ply", "00004.ply", "00005.ply"}) {
    const io::Mesh mesh = io::read_ply(folder / "frames" / name);
    CHECK(mesh.vertices.size() == 6 * 6 + 4 * 4);
    CHECK(mesh.faces.size() == 2 * (5 * 5 + 3 * 3));
  }
  CHECK(!std::filesystem::exists(folder / "frames" / "00001.ply"));
}

TEST_CASE("simulate refuses unknown names with exit code 2") {
  const test::TemporaryFolder folder;
  for (const char* arguments : {"simulate", "simulate nonsense", "simulate drop --world flat",
                                "simulate drop --dt 0", "simulate drop --detector none"}) {
    CHECK(run(folder, arguments).exit_code == 2);
  }
}

TEST_CASE("simulate draws pictures and a film if it can") {
  const test::TemporaryFolder folder;
  if (run(folder, "simulate --help").out.find("--render") == std::string::npos) {
    WARN("skipped: built without Embree, libpng or libwebp");
    return;
  }
  const Outcome outcome = run(
      folder,
      "simulate crossing-ropes --size 0.3 --steps 4 --every 2 --width 64 --samples 2 --render " +
          (folder / "film").string());
  CHECK(outcome.exit_code == 0);
  for (const char* name : {"00000.png", "00002.png", "00004.png"}) {
    CHECK(io::read_file(folder / "film" / name).substr(1, 3) == "PNG");
  }
  const std::string film = io::read_file(folder / "film" / "film.webp");
  CHECK(film.substr(0, 4) == "RIFF");
  CHECK(film.find("ANMF") != std::string::npos);
}
