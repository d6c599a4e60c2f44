// Remembers which index each body and vertex has, so that what is known about them outlasts a
// change of the scene.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "contact/renumbering.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SceneNumbers {
 public:
  /// Takes the present indices. Returns where the bodies and vertices of the last call are now. A
  /// body whose mesh has another number of nodes or faces is gone. Vertices of an obstacle whose
  /// triangles were read again are found by their places.
  Renumbering update(const StepTopology& topology);

 private:
  struct Numbered {
    const btCollisionObject* object;
    int id;  // StepTopology::ids(); another object may get the address
    std::int32_t first_vertex, vertex_count, face_count;
    std::shared_ptr<const Triangles> triangles;  // null for a soft body
  };

  static void renumber(const Numbered& from, const Numbered& to, Renumbering& numbers);

  std::vector<Numbered> bodies_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
