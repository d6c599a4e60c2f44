// What a backend does for a Detector. One source of truth for both: the mesh, the positions, the stats.
#pragma once

#include <vector>

#include "cpu/mesh.h"
#include "lazyccd/contact.h"
#include "lazyccd/scene.h"
#include "lazyccd/stats.h"

namespace lazyccd {

class BackendDetector {
 public:
  virtual ~BackendDetector() = default;
  // The mesh outlives its use: until the next call.
  virtual void set_mesh(const Mesh& mesh) = 0;
  // Sorted contacts; fills the stats. Throws Error.
  virtual void detect(const Positions& start, const Positions& end, std::vector<Contact>& contacts,
                      Stats& stats) = 0;
};

}  // namespace lazyccd
