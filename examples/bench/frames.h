// Pairs of frames to detect on, with the exact truth where it is known.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/mesh.h"

namespace lazyccd::bench {

// Primitives as LazyCCD numbers them: vertex and face, or two edges, smaller index first. Sorted.
using Pairs = std::vector<std::array<std::int32_t, 2>>;

struct FramePair {
  std::string name;
  io::Mesh start, end;
  std::optional<Pairs> truth_vf, truth_ee;  // all that touch during the step
};

// $LAZYCCD_DATA_DIR, else ../shared/data beside the repository.
std::filesystem::path default_data_dir();

// Every folder of DIR/frames that holds frames/*.ply (two files, start and end in the order of
// their names), boxes/*{vf,ee}.json and {vf,ee}_truth.csv. None where DIR is absent.
std::vector<FramePair> read_frames(const std::filesystem::path& data_dir);

// A scene that needs no file: `layers` square sheets of `quads` x `quads` waved quads each, that
// sink into each other over the step.
FramePair waving_sheets(int quads, int layers);

// How many of `truth` are not in `found` (sorted), and the other way round.
struct Difference {
  std::size_t missed, extra;
};
Difference difference(const Pairs& truth, const Pairs& found);

}  // namespace lazyccd::bench
