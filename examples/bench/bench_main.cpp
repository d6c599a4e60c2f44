// The program lazyccd_bench: measures a whole detection of LazyCCD against one pass of Bullet's own
// detection.
//
// All methods work on the same two frames and take turns in each round, so that other load of the
// machine affects all of them equally. Times are medians over the rounds. LazyCCD is measured from
// positions to sorted contacts (vertex-face and edge-edge). Bullet is measured for one pass
// (vertex-face only) on one thread.
#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/bullet/process.h"
#include "bench/frames.h"
#include "bench/machine.h"
#include "io/ply.h"
#include "lazyccd/detector.h"

namespace {

using namespace lazyccd;
using namespace lazyccd::bench;

// One method.
struct Row {
  std::string method, precision;
  int threads;
  std::function<double()> step;  // milliseconds of one step
  std::function<void(Row&)> count = [](Row&) {};
  std::vector<double> times = {};
  std::string found_vf = "", missed_vf = "", false_vf = "", missed_ee = "", false_ee = "";
};

// Compares the contacts of a method with the truth, as text. Writes nothing if the truth is
// unknown.
void compare(const std::optional<Pairs>& truth, const Pairs& found, std::string& missed,
             std::string& extra) {
  if (!truth) return;
  const Difference d = difference(*truth, found);
  missed = std::to_string(d.missed);
  extra = std::to_string(d.extra);
}

std::string count(const std::optional<Pairs>& truth) {
  return truth ? std::to_string(truth->size()) : "";
}

Row lazyccd_row(const FramePair& pair, Detector& detector, std::string method, int threads) {
  Row row{std::move(method), "exact", threads, {}};
  row.step = [&] {
    const auto before = std::chrono::steady_clock::now();
    detector.detect(io::positions(pair.start), io::positions(pair.end));
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before)
        .count();
  };
  row.count = [&](Row& r) {
    Pairs vf, ee;
    for (const Contact& c : detector.detect(io::positions(pair.start), io::positions(pair.end))) {
      if (c.kind == ContactKind::vertex_face)
        vf.push_back({c.primitive_a, c.primitive_b});
      else
        ee.push_back(
            {std::min(c.primitive_a, c.primitive_b), std::max(c.primitive_a, c.primitive_b)});
    }
    std::sort(vf.begin(), vf.end());
    std::sort(ee.begin(), ee.end());
    r.found_vf = std::to_string(vf.size());
    compare(pair.truth_vf, vf, r.missed_vf, r.false_vf);
    compare(pair.truth_ee, ee, r.missed_ee, r.false_ee);
  };
  return row;
}

Row bullet_row(const FramePair& pair, BulletProcess& process, std::string precision) {
  Row row{"Bullet, one pass of its CCD", std::move(precision), 1, [&] { return process.pass(); }};
  row.count = [&](Row& r) {
    const Pairs found = process.contacts();
    r.found_vf = std::to_string(found.size());
    compare(pair.truth_vf, found, r.missed_vf, r.false_vf);
    if (pair.truth_ee) r.missed_ee = std::to_string(pair.truth_ee->size());
  };
  return row;
}

Detector detector_for(const FramePair& pair, int threads, bool rebuild) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = threads;
  options.algorithm.rebuild_every_step = rebuild;
  Detector detector(options);
  detector.set_topology(io::topology(pair.start));
  return detector;
}

void run(const FramePair& pair, int threads, int rounds, std::ostream& csv) {
  Detector refit = detector_for(pair, threads, false);
  Detector rebuild = detector_for(pair, threads, true);
  Detector one = detector_for(pair, 1, false);
  BulletProcess bullet_float(BulletPrecision::single_precision);
  BulletProcess bullet_double(BulletPrecision::double_precision);
  for (BulletProcess* process : {&bullet_float, &bullet_double})
    process->set_mesh(io::positions(pair.start), io::positions(pair.end), pair.start.faces);

  std::vector<Row> rows;
  rows.push_back(lazyccd_row(pair, refit, "LazyCCD", threads));
  rows.push_back(lazyccd_row(pair, rebuild, "LazyCCD, hierarchy built anew", threads));
  if (threads > 1) rows.push_back(lazyccd_row(pair, one, "LazyCCD", 1));
  rows.push_back(bullet_row(pair, bullet_float, "float"));
  rows.push_back(bullet_row(pair, bullet_double, "double"));
  for (Row& row : rows) {
    row.step();  // warm-up: buffers get their size and pages are mapped
    row.count(row);
  }
  for (int round = 0; round < rounds; ++round)
    for (Row& row : rows) row.times.push_back(row.step());

  std::cout << "\n" << pair.name << ": " << pair.start.faces.size() << " faces";
  if (pair.truth_vf && pair.truth_ee)
    std::cout << ", truly touching: " << pair.truth_vf->size() << " VF, " << pair.truth_ee->size()
              << " EE";
  std::cout << "\n";
  std::printf("  %-30s %-7s %7s %10s %8s %9s %7s %9s %7s\n", "method", "prec.", "threads", "ms",
              "times", "VF missed", "false", "EE missed", "false");
  const double first = median(rows[0].times);
  for (const Row& row : rows) {
    const double ms = median(row.times);
    std::printf("  %-30s %-7s %7d %10.2f %8.2f %9s %7s %9s %7s\n", row.method.c_str(),
                row.precision.c_str(), row.threads, ms, ms / first, row.missed_vf.c_str(),
                row.false_vf.c_str(), row.missed_ee.c_str(), row.false_ee.c_str());
    csv << pair.name << ',' << pair.start.faces.size() << ",\"" << row.method << "\","
        << row.precision << ',' << row.threads << ',' << ms << ','
        << *std::min_element(row.times.begin(), row.times.end()) << ',' << count(pair.truth_vf)
        << ',' << count(pair.truth_ee) << ',' << row.found_vf << ',' << row.missed_vf << ','
        << row.false_vf << ',' << row.missed_ee << ',' << row.false_ee << ",\"" << machine()
        << "\"\n";
  }
  std::cout.flush();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "A whole detection of LazyCCD against one pass of Bullet's own continuous detection.\n"
      "Example: lazyccd_bench --threads 2 --csv bench.csv"};
  std::string data = default_data_dir().string(), csv_path;
  std::vector<std::string> frames;
  int threads = 2, rounds = 7;
  app.add_option("frames", frames, "START.ply END.ply; default: all frames of the data folder")
      ->expected(2)
      ->check(CLI::ExistingFile);
  app.add_option("--data", data, "data folder, which contains frames/")->capture_default_str();
  app.add_option("--threads", threads, "number of threads of LazyCCD")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--rounds", rounds, "number of rounds for the medians")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--csv", csv_path, "also write the table to this file");
  CLI11_PARSE(app, argc, argv);

  try {
    std::vector<FramePair> pairs;
    if (frames.empty())
      pairs = read_frames(data);
    else
      pairs.push_back({frames[0], io::read_ply(frames[0]), io::read_ply(frames[1]), {}, {}});
    if (pairs.empty()) {
      std::cout << "no frames in " << data << "; using a generated scene of wavy sheets\n";
      pairs.push_back(waving_sheets(64, 4));
    }
    std::ofstream csv;
    if (!csv_path.empty()) csv.open(csv_path);
    csv << "scene,faces,method,precision,threads,median_ms,least_ms,true_vf,true_ee,found_vf,"
           "missed_vf,false_vf,"
           "missed_ee,false_ee,machine\n";
    std::cout << machine() << ", medians of " << rounds
              << " rounds; column times: relative to the first row\n";
    for (const FramePair& pair : pairs) run(pair, threads, rounds, csv);
  } catch (const std::exception& error) {
    std::cerr << "lazyccd_bench: " << error.what() << "\n";
    return 1;
  }
}
