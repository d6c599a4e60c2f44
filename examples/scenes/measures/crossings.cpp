#include "scenes/measures/crossings.h"

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
    : detector_(on_one_thread()), last_(read_positions(world)) {
  detector_.set_topology(read_surface(world).topology());
}

void CrossingCounter::step(const PhysicsWorld& world) {
  std::vector<btScalar> now = read_positions(world);
  const std::size_t count = now.size() / 3;
  for (const Contact& contact :
       detector_.detect(Positions(last_.data(), count), Positions(now.data(), count))) {
    ++(contact.kind == ContactKind::vertex_face ? vertex_face_ : edge_edge_);
  }
  last_.swap(now);
}

}  // namespace lazyccd::scenes
