// Reads a step from Bullet: the bodies that take part as one topology, and their motion.
#pragma once

#include <functional>
#include <unordered_map>
#include <vector>

#include "lazyccd/bullet/options.h"
#include "motion/motion.h"
#include "scene/obstacles.h"
#include "scene/previous_step.h"
#include "scene/sleepers.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"
#include "util/scratch_vector.h"
#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class StepReader {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;
  /// Fills start, end and velocity of the vertices [first, last) of a soft body. Sets `rate` if it
  /// is not 1 / dt. Zeroes the inverse mass of nodes that are moved by something else than
  /// velocities and contacts (anchors). Called on several threads with disjoint ranges.
  using Fill = std::function<void(const SoftScene&, const SoftScene::BodyRecord&,
                                  std::int32_t first, std::int32_t last, Motion&)>;

  struct Changes {
    bool topology = false;  ///< indices, pair rules or margins changed
    /// Bodies that appeared, changed or were placed elsewhere, as sorted indices. The start may
    /// contain intersections with them that no motion caused.
    std::vector<std::int32_t> changed_bodies;
    /// Those of them that are not where the last step left them.
    std::vector<std::int32_t> placed_bodies;
  };

  /// `warnings` must outlive the reader.
  StepReader(const SolverOptions& options, WarningLog& warnings, const Threads& threads)
      : options_(options),
        warnings_(warnings),
        threads_(threads),
        scene_(CollisionFlags(options.obey_collision_flags)),
        obstacles_(static_cast<btScalar>(options.jump_speed)) {}

  /// Starts a step. Call it before Bullet moves anything, because Bullet then clears its marks of
  /// changed topology. `is_own_solver`: as in RefusedPairs::begin_step(). `forces`: as in
  /// ExcludedBodies::begin_step().
  void begin_step(const Bodies& bodies, bool is_own_solver = false,
                  const ExcludedBodies::Forces* forces = nullptr);
  /// Takes a pair that Bullet's dispatch brought to the solver.
  void accept_pair(const btCollisionObject& a, const btCollisionObject& b) {
    scene_.refused_pairs().accept(a, b);
  }
  /// Reads the whole scene and its motion over `dt` seconds. Sleepers that nothing awake comes near
  /// are left out.
  Changes read(const Bodies& bodies, double dt, const Fill& fill);
  /// Call after the response. If it moved something to a sleeper that was left out, undoes the
  /// response and reads the scene again, with this sleeper. Returns true if it did; `changes` is
  /// then what changed.
  bool reread_if_sleepers_reached(const Bodies& bodies, const Fill& fill, Changes& changes);
  /// Call after the response. If the response moved soft bodies out of the region in which
  /// obstacles were read, reads the obstacles of a larger region and undoes the response. Returns
  /// true if it did; the topology has changed then.
  bool reread_obstacles_if_left();
  /// False if no two bodies that collide can come within `distance` metres of each other. Decided
  /// by the bounds of each body's motion as it was read.
  bool may_meet(double distance) const;
  /// Remembers the end of the step. The next step sees from it which bodies were placed elsewhere,
  /// and which sleepers nothing came near.
  void end_step();
  /// Forgets where the soft bodies ended the last step.
  void forget_ends() { previous_.forget_soft_bodies(); }
  /// Says that the application put a body elsewhere: the next step does not sweep it from where it
  /// was.
  void teleported(const btCollisionObject& object) {
    previous_.forget(object);
    sleepers_.forget(object);
    obstacles_.teleported(object);
  }
  /// See Obstacles. `body`: index in topology(); nothing happens if it is a soft body.
  void read_whole_mesh(std::int32_t body) {
    const int obstacle = topology_.bodies()[body].obstacle;
    if (obstacle >= 0) obstacles_.read_whole_mesh(obstacles_.records()[obstacle].unique_id);
  }
  void read_parts_of_meshes() { obstacles_.read_parts_of_meshes(); }
  /// See RigidPoses::hold_at_start().
  void hold_at_start(const btCollisionObject& object) { obstacles_.hold_at_start(object); }
  /// Makes the next step read the soft bodies again.
  void invalidate_soft_bodies() { scene_.invalidate(); }
  /// Makes the next step read everything again.
  void invalidate() {
    sleepers_.forget_all();
    scene_.invalidate();
    obstacles_.invalidate();
  }

  const SoftScene& scene() const { return scene_; }
  const Sleepers& sleepers() const { return sleepers_; }
  /// By body of the topology: 1 if nothing but a contact moves it in the step. So it is a soft body
  /// or a dynamic rigid one that sleeps, or an obstacle that stands still. Valid until the next
  /// read.
  Span<const char> at_rest() const { return at_rest_; }
  const StepTopology& topology() const { return topology_; }
  Motion& motion() { return motion_; }
  const Motion& motion() const { return motion_; }
  /// Smallest thickness that contacts of a soft body can keep, metres. A gap this wide is closed
  /// neither by the rounding of positions nor by the residual of the response.
  double resolution(const btSoftBody& body) const;
  /// The largest of those above `known` of bodies that come so near another one, or collide with
  /// themselves; 0 if there is none. `known`, metres.
  double largest_resolution(double known) const;

 private:
  // What a pass over some nodes of one body finds.
  struct Found {
    AxisBox swept = AxisBox::empty();
    bool pins_unchanged = true;
    std::int32_t bad_vertex = -1;  // first vertex that is not finite or moves too far; -1: none
  };

  Changes read_members(const Bodies& bodies, const Fill& fill);
  void look_for_algorithms();
  bool gather_soft(const Fill& fill);
  void gather_block(const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last,
                    const Fill& fill, Found& found);
  // Excludes the body of a vertex that is not finite or moves too far.
  void exclude(std::int32_t vertex);
  // How far a node of the body may move in a step from `start`, metres.
  double longest_step(const SoftScene::BodyRecord& record, const btVector3& start) const;
  // Finds the soft bodies that changed or were placed, and sweeps the pinned nodes of the others.
  void sweep_prescribed_nodes(Changes& changes);
  // Pinned nodes that the application moved between steps start at their `last` end, so their path
  // is tested. Returns true if the body was put elsewhere instead: its free nodes were moved too,
  // or its pinned nodes jumped. Then its nodes start where they are.
  bool sweep_prescribed_nodes(const SoftScene::BodyRecord& record,
                              const std::vector<btScalar>& last);
  bool pinned_nodes_jumped(const SoftScene::BodyRecord& record,
                           const std::vector<btScalar>& last) const;
  // Depth for tessellate(), metres: half the smallest thickness of contacts with obstacles. So at
  // least half of the gap to a round surface remains.
  double depth_in_obstacles() const;
  void gather_obstacles();
  AxisBox bounds_of(const RigidMotion& rigid) const;
  std::size_t index_of(const SoftScene::BodyRecord& record) const {
    return static_cast<std::size_t>(&record - scene_.bodies().data());
  }
  bool stands_still(const SoftScene::BodyRecord& record) const;
  void find_sleeping_members();
  void find_obstacles_at_rest();
  // Bounds of what is awake, over the step: soft bodies, and rigid bodies that move.
  Sleepers::Boxes awake_bounds() const;
  // The same of what the response moved.
  Sleepers::Boxes moved_bounds() const;
  // Bodies that stay farther apart than this have no contact, metres.
  btScalar contact_distance() const;
  void find_obstacle_boxes();
  // Bounds of the start positions of each soft body that collides with obstacles.
  Obstacles::Boxes starts_near_obstacles() const;
  // Obstacles that are new or were put elsewhere, and reach the soft bodies. By index in
  // Obstacles::records(): nonzero for these.
  ScratchVector<char> find_placed_obstacles() const;
  // Reads the whole meshes around bodies that were placed, or that were placed around them. Returns
  // true if there are such meshes. `changed_bodies`: soft bodies; `placed_obstacles`: as above.
  bool read_meshes_around(const std::vector<std::int32_t>& changed_bodies,
                          Span<const char> placed_obstacles);
  bool may_be_inside(const SoftScene::BodyRecord& body, const Obstacles::Record& obstacle) const;
  // The least thickness of contacts with coordinates up to `farthest`, metres.
  double needed_thickness(btScalar farthest) const;
  // Sets resolution() of each body. Keeps the old value while it is no more than 4 times too large,
  // because a new one changes the thickness of contacts.
  void update_resolution();

  SolverOptions options_;
  WarningLog& warnings_;
  Threads threads_;
  std::unordered_map<const btSoftBody*, double> resolution_of_;
  Sleepers sleepers_;
  SoftScene scene_;
  Obstacles obstacles_;
  StepTopology topology_;
  Motion motion_;
  PreviousStep previous_;
  std::vector<AxisBox> bounds_;  // of each body's motion, in the topology's order
  std::vector<char> at_rest_;    // of each body, in the topology's order
  // Of each soft body that collides with obstacles: bounds of its motion, and the largest margin.
  Obstacles::Boxes obstacle_boxes_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
