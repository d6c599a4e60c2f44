// Bullet's anchors: which soft vertices they hold to which object.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/soft_scene.h"

class btCollisionObject;

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Anchors {
 public:
  /// Reads the anchors of all bodies.
  void read(const SoftScene& scene);
  bool empty() const { return anchors_.empty(); }
  /// True if an anchor holds the soft vertex to the object.
  bool hold(std::int32_t soft_vertex, const btCollisionObject* object) const;
  /// Adds the vertices of a soft body that anchors hold to the object.
  void add_held(const SoftScene::BodyRecord& body, const btCollisionObject* object,
                std::vector<std::int32_t>& vertices) const;

 private:
  /// The first anchor of this vertex or a later one, in anchors_.
  std::size_t first_anchor(std::int32_t vertex) const;

  struct Anchor {
    std::int32_t vertex;
    const btCollisionObject* object;
  };
  std::vector<Anchor> anchors_;  // sorted by vertex
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
