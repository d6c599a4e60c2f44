// Tests the commands of the program lazyccd, run as a user runs them.
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/file.h"
#include "io/ply.h"
#include "program/run_program.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/temporary.h"

using namespace lazyccd;
using Matchers::ContainsSubstring;
using test::Outcome;
using test::run;

namespace {

// One triangle above another. Vertex 3 falls through the lower one and meets it at half of the
// step.
io::Mesh two_triangles() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.25, 0.25, 0.125}, {2, 2, 3}, {2, 3, 3}},
          {{0, 1, 2}, {3, 4, 5}}};
}

// Writes start.ply and end.ply. Returns their paths as arguments.
std::string write_frames(const test::TemporaryFolder& folder) {
  io::Mesh mesh = two_triangles();
  io::write_ply(folder / "start.ply", mesh);
  mesh.vertices[3][2] = -0.125;
  io::write_ply(folder / "end.ply", mesh);
  return (folder / "start.ply").string() + " " + (folder / "end.ply").string();
}

std::string query_rows(const std::string& end_of_row) {
  std::string text;
  for (const char* point : {"1,4,1,4,1,8", "0,1,0,1,0,1", "1,1,0,1,0,1", "0,1,1,1,0,1",
                            "1,4,1,4,-1,8", "0,1,0,1,0,1", "1,1,0,1,0,1", "0,1,1,1,0,1"}) {
    text += point + end_of_row + "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("detect writes one line per contact with vertex indices and time of impact") {
  const test::TemporaryFolder folder;
  const std::string frames = write_frames(folder);
  for (const char* backend : {"auto", "cpu"}) {
    const Outcome outcome = run(folder, "detect " + frames + " --threads 2 --backend " + backend +
                                            " --out " + (folder / "contacts.csv").string() +
                                            " --stats " + (folder / "stats.json").string());
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.err.empty());
    CHECK_THAT(outcome.out, ContainsSubstring("1 vertex-face and 0 edge-edge contacts"));
    CHECK(io::read_file(folder / "contacts.csv") == "kind,p0,p1,p2,p3,toi\nvf,3,0,1,2,0.5\n");
    const auto stats = nlohmann::json::parse(io::read_file(folder / "stats.json"));
    CHECK(stats["scene"]["vertices"] == 6);
    CHECK(stats["scene"]["edges"] == 6);
    CHECK(stats["contacts"]["vf"] == 1);
    CHECK(stats["contacts"]["ee"] == 0);
    CHECK(stats["hash"].get<std::string>().size() == 16);
    for (const char* stage : {"refit", "traverse", "sort", "total"}) {
      CHECK(stats["milliseconds"][stage].is_number());
    }
    CHECK(stats["work"]["front_nodes"].is_number_integer());
  }
}

TEST_CASE("detect gives the same contacts and hash with one thread and with several") {
  const auto data = test::data_dir();
  if (!data) return;
  const test::TemporaryFolder folder;
  const std::filesystem::path frames = *data / "frames" / "cloth-funnel" / "frames";
  std::string contacts, hash;
  for (const char* threads : {"1", "2", "5"}) {
    const Outcome outcome =
        run(folder, "detect " + (frames / "227.ply").string() + " " +
                        (frames / "228.ply").string() + " --threads " + threads + " --out " +
                        (folder / "c.csv").string() + " --stats " + (folder / "s.json").string());
    REQUIRE(outcome.exit_code == 0);
    const std::string these = io::read_file(folder / "c.csv");
    const auto stats = nlohmann::json::parse(io::read_file(folder / "s.json"));
    if (contacts.empty()) {
      contacts = these;
      hash = stats["hash"];
    }
    CHECK(these == contacts);
    CHECK(stats["hash"] == hash);
  }
}

TEST_CASE(
    "queries writes one line per query and counts missed and false hits if the truth is known") {
  const test::TemporaryFolder folder;
  const std::string out = (folder / "answers.csv").string();
  io::write_file(folder / "plain.csv", query_rows(""));
  Outcome outcome =
      run(folder, "queries " + (folder / "plain.csv").string() + " --kind vf --out " + out);
  CHECK(outcome.exit_code == 0);
  CHECK(io::read_file(out) == "query_index,hit,toi\n0,1,0.5\n");
  CHECK_THAT(outcome.out, ContainsSubstring("1 queries, 1 hits"));
  CHECK_THAT(outcome.out, !ContainsSubstring("missed"));

  io::write_file(folder / "truth.csv", query_rows(",1") + query_rows(",0"));
  outcome = run(folder, "queries " + (folder / "truth.csv").string() + " --kind vf --out " + out +
                            " --stats " + (folder / "stats.json").string());
  CHECK(outcome.exit_code == 0);
  CHECK(io::read_file(out) == "query_index,hit,toi\n0,1,0.5\n1,1,0.5\n");
  CHECK_THAT(outcome.out, ContainsSubstring("missed 0, false hits 1"));
  const auto stats = nlohmann::json::parse(io::read_file(folder / "stats.json"));
  CHECK(stats["queries"] == 2);
  CHECK(stats["truth"]["false_hits"] == 1);

  // The same eight points as two edges, which never touch.
  outcome = run(folder, "queries " + (folder / "plain.csv").string() + " --kind ee --out " + out);
  CHECK(outcome.exit_code == 0);
  CHECK(io::read_file(out) == "query_index,hit,toi\n0,0,inf\n");
}

TEST_CASE("coordinates that had to be rounded are noted") {
  const test::TemporaryFolder folder;
  std::string text = query_rows("");
  text.replace(0, 3, "1,3");
  io::write_file(folder / "q.csv", text);
  const Outcome outcome = run(folder, "queries " + (folder / "q.csv").string() + " --kind vf");
  CHECK(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, ContainsSubstring("1 coordinates were rounded"));
}

TEST_CASE("help has an example for each command and ends with success") {
  const test::TemporaryFolder folder;
  CHECK(run(folder, "--help").exit_code == 0);
  for (const char* command : {"detect", "queries"}) {
    const Outcome outcome = run(folder, std::string(command) + " --help");
    CHECK(outcome.exit_code == 0);
    CHECK_THAT(outcome.out, ContainsSubstring(std::string("Example: lazyccd ") + command));
  }
}

TEST_CASE("bad usage ends with exit code 2") {
  const test::TemporaryFolder folder;
  const std::string frames = write_frames(folder);
  for (const std::string& arguments :
       {std::string(), std::string("nonsense"), std::string("detect"),
        "detect " + frames + " extra", "detect " + frames + " --backend tpu",
        "detect " + frames + " --threads -1", "detect " + frames + " --threads many",
        "detect " + frames + " --unknown", "detect " + frames + " --out", std::string("queries"),
        std::string("queries q.csv"), std::string("queries q.csv --kind ff")}) {
    CAPTURE(arguments);
    const Outcome outcome = run(folder, arguments);
    CHECK(outcome.exit_code == 2);
    CHECK_FALSE(outcome.err.empty());
  }
}

TEST_CASE("failures end with exit code 1 and a message that names the place") {
  const test::TemporaryFolder folder;
  const std::string frames = write_frames(folder);
  const std::string start = (folder / "start.ply").string();
  const auto message = [&](const std::string& arguments) {
    CAPTURE(arguments);
    const Outcome outcome = run(folder, arguments);
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.err.rfind("lazyccd: ", 0) == 0);
    return outcome.err;
  };
  const auto second_frame = [&](const io::Mesh& mesh) {
    io::write_ply(folder / "bad.ply", mesh);
    return "detect " + start + " " + (folder / "bad.ply").string();
  };

  CHECK_THAT(message("detect " + start + " " + (folder / "missing.ply").string()),
             ContainsSubstring("missing.ply: cannot be opened"));
  CHECK_THAT(message("detect " + frames + " --out " + (folder / "missing" / "c.csv").string()),
             ContainsSubstring("cannot be opened for writing"));

  const std::string whole = io::read_file(folder / "start.ply");
  io::write_file(folder / "cut.ply", whole.substr(0, whole.size() - 5));
  CHECK_THAT(message("detect " + start + " " + (folder / "cut.ply").string()),
             ContainsSubstring("cut short"));
  io::write_file(folder / "cube.ply", "solid cube\n");
  CHECK_THAT(message("detect " + start + " " + (folder / "cube.ply").string()),
             ContainsSubstring("not a PLY file"));

  io::Mesh mesh = two_triangles();
  mesh.faces.pop_back();
  CHECK_THAT(message(second_frame(mesh)), ContainsSubstring("differ in topology"));
  mesh = two_triangles();
  mesh.vertices[4][1] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(message(second_frame(mesh)), ContainsSubstring("vertex 4 is not finite"));

  mesh = two_triangles();
  mesh.faces[1] = {3, 4, 4};
  io::write_ply(folder / "flat.ply", mesh);
  const std::string flat = (folder / "flat.ply").string();
  CHECK_THAT(message("detect " + flat + " " + flat), ContainsSubstring("face 1"));

  io::write_file(folder / "cut.csv", query_rows(",1") + "0,1,0,1,0,1,1\n");
  CHECK_THAT(message("queries " + (folder / "cut.csv").string() + " --kind vf"),
             ContainsSubstring("cut short"));
  CHECK_THAT(message("queries " + start + " --kind vf"), ContainsSubstring("ends in .csv or .bin"));
}
