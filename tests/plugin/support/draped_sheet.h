// A sheet on top of an obstacle, in a motion of one step.
#pragma once

#include <LinearMath/btTransform.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "contact/pair_surfaces.h"
#include "filter/contact_filter.h"
#include "obstacles/simple_contacts.h"
#include "plugin/support/obstacle_worlds.h"
#include "scene/step_reader.h"

namespace lazyccd::test {

/// A sheet of 0.28 m on top of a kinematic obstacle. Both move at random, and the obstacle turns.
class DrapedSheet {
 public:
  /// `height`: of the obstacle's surface under the node at x, z plus a gap, metres; in the frame of
  /// the obstacle. `most_turn`: of the obstacle, radians. The sheet's middle is at `middle_x`, and
  /// it has `nodes` nodes a side.
  using Height = std::function<double(double x, double z, double gap)>;
  DrapedSheet(std::unique_ptr<btCollisionShape> shape, Height height, unsigned number,
              double most_turn = 0.3, double middle_x = 0, int nodes = 13)
      : nodes_(nodes),
        random_(number),
        world_(scenes::World::deformable, 0),
        warnings_({}),
        height_(std::move(height)),
        middle_x_(middle_x) {
    options_.jump_speed = 1e30;
    sheet_ = world_.add_sheet(nodes_, 0.28, 0, 0);
    const btScalar far = btScalar(within(0, 1) < 0.3 ? 100 : 0);
    place_.setIdentity();
    place_.setOrigin(btVector3(far, 0, far));
    obstacle_ = world_.add(std::move(shape), place_.getOrigin());
    obstacle_->setCollisionFlags(obstacle_->getCollisionFlags() |
                                 btCollisionObject::CF_KINEMATIC_OBJECT);
    bodies_.push_back(sheet_);
    reader_ = std::make_unique<bullet::StepReader>(options_, warnings_, threads_);
    gap_ = within(-0.01, 0.05);
    const double speed = within(0, 1) < 0.5 ? 0.01 : 0.1;
    move_ = btVector3(amount(speed), amount(speed), amount(speed));
    noise_ = within(0, 0.004);
    const btQuaternion turn(btVector3(0, 1, amount(1)).normalized(), amount(most_turn));
    turned_ = btTransform(turn, place_.getOrigin() + btVector3(amount(speed), amount(speed), 0));
  }

  /// Anchors nodes to the obstacle, at its centre.
  void anchor(std::initializer_list<int> nodes) {
    for (const int node : nodes) {
      sheet_->appendDeformableAnchor(node, btRigidBody::upcast(obstacle_));
      anchored_.push_back(node);
    }
  }

  /// Adds a static obstacle; `place`: in the frame of the first one, metres.
  void add_obstacle(std::unique_ptr<btCollisionShape> shape, const btVector3& place) {
    world_.add(std::move(shape), place_.getOrigin() + place);
  }

  void read() {
    for (const bool moves : {false, true}) {  // the first step makes the obstacle known
      reader_->begin_step(bodies_);
      if (moves) obstacle_->setWorldTransform(turned_);
      reader_->read(bodies_, 0.01,
                    [this](const bullet::SoftScene& scene, const auto&, std::int32_t first,
                           std::int32_t last, bullet::Motion& motion) {
                      for (std::int32_t v = first; v < last; ++v)
                        place(scene.node_index(v), v, motion);
                    });
    }
  }
  bullet::StepReader& reader() { return *reader_; }

  double within(double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random_);
  }

 private:
  btScalar amount(double size) { return static_cast<btScalar>(within(-size, size)); }
  void place(int node, std::int32_t v, bullet::Motion& motion) {
    if (std::find(anchored_.begin(), anchored_.end(), node) != anchored_.end()) {
      for (int k = 0; k < 3; ++k) {
        motion.input().start[3 * static_cast<std::size_t>(v) + k] = place_.getOrigin()[k];
        motion.end[3 * static_cast<std::size_t>(v) + k] = turned_.getOrigin()[k];
      }
      return;
    }
    const double x = middle_x_ + 0.28 * (node % nodes_ / (nodes_ - 1.0) - 0.5);
    const double z = 0.28 * (node / nodes_ / (nodes_ - 1.0) - 0.5);
    const btVector3 start(static_cast<btScalar>(x), static_cast<btScalar>(height_(x, z, gap_)),
                          static_cast<btScalar>(z));
    for (int k = 0; k < 3; ++k) {
      motion.input().start[3 * static_cast<std::size_t>(v) + k] = place_.getOrigin()[k] + start[k];
      motion.end[3 * static_cast<std::size_t>(v) + k] =
          place_.getOrigin()[k] + start[k] + move_[k] + amount(noise_);
    }
    motion.input().velocity[v].setZero();
  }

  int nodes_;  // a side
  std::mt19937 random_;
  ObstacleWorld world_;
  bullet::SolverOptions options_;
  bullet::WarningLog warnings_;
  Threads threads_{1};
  btSoftBody* sheet_;
  btCollisionObject* obstacle_;
  btAlignedObjectArray<btSoftBody*> bodies_;
  std::unique_ptr<bullet::StepReader> reader_;
  btTransform place_, turned_;
  btVector3 move_;
  double gap_, noise_;
  Height height_;
  double middle_x_;
  std::vector<int> anchored_;
};

/// Surfaces of all bodies, without friction.
inline bullet::PairSurfaces surfaces_of(const bullet::StepTopology& topology) {
  bullet::PairSurfaces surfaces(bullet::SolverOptions(), bullet::WorldKind::deformable);
  std::vector<bullet::BodySurface> bodies;
  for (const auto& body : topology.bodies())
    bodies.push_back({body.margin, 0, body.soft != nullptr});
  surfaces.update(bodies);
  return surfaces;
}

/// What meets the obstacle under a sheet as what it is. The sheet must have been read, and outlive
/// it.
struct DrapedContacts {
  explicit DrapedContacts(DrapedSheet& draped)
      : topology(draped.reader().topology()),
        motion(draped.reader().motion()),
        surfaces(surfaces_of(topology)),
        filter(draped.reader().scene(), topology, motion, surfaces, untangling),
        contacts(topology, motion, surfaces, filter) {
    filter.read_anchors();
    contacts.set_topology({});
  }

  const bullet::StepTopology& topology;
  bullet::Motion& motion;
  const bullet::PairSurfaces surfaces;
  const bullet::Untangling untangling;
  bullet::ContactFilter filter;
  bullet::SimpleContacts contacts;
};

}  // namespace lazyccd::test
