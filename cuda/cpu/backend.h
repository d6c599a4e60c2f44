// What a backend does for a Detector. One source of truth for both: the mesh, the positions, the stats.
#pragma once

#include "cpu/scene/mesh.h"
#include "lazyccd/contact.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"
#include "lazyccd/stats.h"

namespace lazyccd {

class BackendDetector {
 public:
  virtual ~BackendDetector() = default;
  // The mesh outlives its use: until the next call.
  virtual void set_mesh(const Mesh& mesh) = 0;
  // Sorted contacts, valid until the next call; fills the stats. Throws Error.
  virtual Span<const Contact> detect(const Positions& start, const Positions& end, Stats& stats) = 0;
};

}  // namespace lazyccd
