// Pairs of frames for benches of detection, with the exact truth if it is known.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/mesh.h"

namespace lazyccd::bench {

/// Sorted pairs of primitives, numbered as LazyCCD does: vertex and face, or two edges with the
/// smaller index first.
using Pairs = std::vector<std::array<std::int32_t, 2>>;

/// The start and the end of a step.
struct FramePair {
  std::string name;
  io::Mesh start, end;
  std::optional<Pairs> truth_vf, truth_ee;  // all pairs that touch during the step
};

/// Returns $LAZYCCD_DATA_DIR if it is set, else shared/data beside the repository.
std::filesystem::path default_data_dir();

/// Reads every folder of DIR/frames that has frames/*.ply (two files: start and end in the order of
/// their names), and the truth from boxes/*{vf,ee}.json and {vf,ee}_truth.csv. Returns nothing if
/// DIR does not exist.
std::vector<FramePair> read_frames(const std::filesystem::path& data_dir);

/// Makes a scene that needs no file: `layers` wavy square sheets of `quads` x `quads` quads, which
/// move into each other during the step.
FramePair waving_sheets(int quads, int layers);

/// How many pairs of `truth` are missing in `found`, and how many of `found` are not in `truth`.
struct Difference {
  std::size_t missed, extra;
};
Difference difference(const Pairs& truth, const Pairs& found);

}  // namespace lazyccd::bench
