// Meshes with positions in several frames, and the contacts that the CPU finds in their steps.
#pragma once

#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "lazyccd/detector.h"
#include "models/worlds.h"

namespace lazyccd {

// A mesh with positions in several frames.
struct Frames : models::BodyMesh {
  std::string name;
  std::vector<std::vector<float>> at;

  Positions positions(std::size_t f) const { return {at[f].data(), at[f].size() / 3}; }
  std::size_t steps() const { return at.size() - 1; }
};

inline Frames worlds(std::int32_t count, std::int32_t bodies, int frames) {
  const models::WorldsScene scene(count, bodies, models::Layout::one_place);
  Frames f{scene, std::to_string(count) + " worlds of " + std::to_string(bodies) + " sheets", {}};
  for (int i = 0; i < frames; ++i) {
    f.at.push_back(scene.at[i % 2]);
    // The sheets come closer step by step.
    for (std::size_t k = 1; k < f.at.back().size(); k += 3)
      f.at.back()[k] *= 1.0f - 0.1f * static_cast<float>(i);
  }
  return f;
}

// The same with folds, so that adjacent faces touch.
inline Frames crumpled(Frames f) {
  f.name = "crumpled " + f.name;
  for (std::size_t i = 1; i < f.at.size(); i += 2)
    for (std::size_t k = 0; k < f.at[i].size(); ++k)
      if (f.bodies[static_cast<std::size_t>(f.body_of_vertex[k / 3])].world >= 0)
        f.at[i][k] += static_cast<float>(0.08 * models::noise(static_cast<std::uint32_t>(k), 7));
  return f;
}

// Triangles with corners on a lattice, which need exact arithmetic, in the steps of `exact`; in the
// others they are far apart.
inline Frames lattice(std::int32_t count, const std::vector<bool>& exact) {
  Frames f{{}, std::to_string(count) + " triangles on a lattice", {}};
  std::mt19937 random(11);
  for (std::int32_t i = 0; i < count; ++i) {
    f.bodies.emplace_back();
    f.body_of_vertex.insert(f.body_of_vertex.end(), 3, i);
    f.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  for (std::size_t step = 0; step <= exact.size(); ++step) {
    const bool near = (step < exact.size() && exact[step]) || (step > 0 && exact[step - 1]);
    std::vector<float> x;
    for (std::int32_t v = 0; v < 3 * count; ++v)
      for (int k = 0; k < 3; ++k)
        x.push_back(static_cast<float>(random() % 8u) +
                    (near || k != 0 ? 0.0f : 20.0f * static_cast<float>(v / 3)));
    f.at.push_back(x);
  }
  return f;
}

// The meshes that most checks run on. `small`: for the sanitizers.
struct CheckedFrames {
  Frames few, many, exact;

  explicit CheckedFrames(bool small)
      : few(worlds(small ? 3 : 12, 3, 5)),
        many(worlds(small ? 5 : 300, 5, 5)),
        exact(lattice(small ? 30 : 100, std::vector<bool>(4, true))) {}
};

struct Found {
  std::vector<Contact> contacts;
  std::uint64_t hash = 0;

  bool operator==(const Found& other) const {
    return hash == other.hash && contacts.size() == other.contacts.size() &&
           (contacts.empty() || std::memcmp(contacts.data(), other.contacts.data(),
                                            contacts.size() * sizeof(Contact)) == 0);
  }
};

inline Found found_by(Detector& detector, const Frames& frames, std::size_t step) {
  const Span<const Contact> c = detector.detect(frames.positions(step), frames.positions(step + 1));
  return {{c.begin(), c.end()}, detector.stats().hash};
}

inline DetectorOptions on(Backend backend) {
  DetectorOptions options;
  options.backend = backend;
  return options;
}

inline std::vector<Found> truth_of(const Frames& frames) {
  Detector cpu(on(Backend::cpu));
  cpu.set_topology(frames.topology());
  std::vector<Found> truth;
  for (std::size_t s = 0; s < frames.steps(); ++s) truth.push_back(found_by(cpu, frames, s));
  return truth;
}

}  // namespace lazyccd
