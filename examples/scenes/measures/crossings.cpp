#include "scenes/measures/crossings.h"

#include <utility>

namespace lazyccd::scenes {
namespace {

DetectorOptions on_one_thread() {
  DetectorOptions options;
  options.threads = 1;
  return options;
}

}  // namespace

// One thread: the worker threads of this detector would stay awake during the next step, which is
// timed.
CrossingCounter::CrossingCounter(const PhysicsWorld& world)
    : CrossingCounter(read_surface(world), read_positions(world)) {}

CrossingCounter::CrossingCounter(const Surface& surface, std::vector<btScalar> positions)
    : detector_(on_one_thread()), last_(std::move(positions)) {
  detector_.set_topology(surface.topology());
}

void CrossingCounter::step(const PhysicsWorld& world) { step(read_positions(world)); }

void CrossingCounter::step(std::vector<btScalar> now) {
  const std::size_t count = now.size() / 3;
  for (const Contact& contact :
       detector_.detect(Positions(last_.data(), count), Positions(now.data(), count))) {
    ++(contact.kind == ContactKind::vertex_face ? vertex_face_ : edge_edge_);
  }
  last_.swap(now);
}

}  // namespace lazyccd::scenes
