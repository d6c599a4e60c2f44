// Tests the commands of the program lazyccd for generated models and the study.
#include <algorithm>
#include <filesystem>
#include <string>

#include "io/file.h"
#include "io/ply.h"
#include "program/run_program.h"
#include "support/catch.h"
#include "support/temporary.h"

using namespace lazyccd;
using Matchers::ContainsSubstring;
using test::Outcome;
using test::run;

TEST_CASE("models lists the models and writes frames of one mesh") {
  const test::TemporaryFolder folder;
  CHECK_THAT(run(folder, "models").out, ContainsSubstring("n-body"));
  const std::string out = (folder / "frames").string();
  const Outcome outcome = run(folder, "models cloud-64 --first 3 --last 4 --out " + out);
  REQUIRE(outcome.exit_code == 0);
  const io::Mesh start = io::read_ply(folder / "frames" / "cloud-64-3.ply");
  const io::Mesh end = io::read_ply(folder / "frames" / "cloud-64-4.ply");
  CHECK(start.faces.size() == 64);
  CHECK(start.faces == end.faces);
  CHECK(start.vertices != end.vertices);
  const Outcome unknown = run(folder, "models cow");
  CHECK(unknown.exit_code == 1);
  CHECK_THAT(unknown.err, ContainsSubstring("cloud-64"));
}

TEST_CASE("the study writes rows per setting and per step and combines settings") {
  const test::TemporaryFolder folder;
  const std::string csv = (folder / "study.csv").string(), steps = (folder / "steps.csv").string();
  const Outcome outcome =
      run(folder,
          "study --model cloud-64 cloud-256 --last 6 --threads 1 2 --front on off "
          "--strategy static_list task_stealing --volume box dop18 "
          "--culling default none non_penetration+normal_cones+orphan_sets --csv " +
              csv + " --steps-csv " + steps);
  REQUIRE(outcome.exit_code == 0);
  const auto lines = [](const std::string& file) {
    const std::string text = io::read_file(file);
    return std::count(text.begin(), text.end(), '\n');
  };
  constexpr int settings = 2 * 2 * 2 * 2 * 3;
  CHECK(lines(csv) == 1 + 2 * settings);
  CHECK(lines(steps) == 1 + 2 * settings * 5);
  CHECK_THAT(io::read_file(csv), ContainsSubstring("hash"));
}

TEST_CASE("a study of an unknown model or setting is refused") {
  const test::TemporaryFolder folder;
  CHECK(run(folder, "study --model cloud-64 --culling everything").exit_code == 1);
  CHECK(run(folder, "study --model cloud-64 --strategy eager").exit_code == 1);
  CHECK(run(folder, "study --model cloud-64 --first 5 --last 6").exit_code == 1);
}
