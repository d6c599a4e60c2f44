// Reads a step from Bullet: what takes part, as one topology, and its motion.
#pragma once

#include <functional>
#include <vector>

#include "util/warning_log.h"
#include "lazyccd/bullet/options.h"
#include "motion/motion.h"
#include "scene/obstacles.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class StepReader {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;
  // Fills start, end and velocity of some of a soft body's vertices, first to last - 1, rate where
  // it is not one over the step, and zeroes the inverse mass of nodes that something else than
  // velocity and contact moves.
  using Fill = std::function<void(const SoftScene&, const SoftScene::BodyRecord&,
                                  std::int32_t first, std::int32_t last, Motion&)>;

  struct Changes {
    bool topology = false;  // indices, pair rules or margins are others than before
    bool start = false;  // bodies came or were put elsewhere: what intersects now did not come so
  };

  // The log of warnings must outlive it.
  StepReader(const SolverOptions& options, WarningLog& warnings, const Threads& threads)
      : options_(options), warnings_(warnings), threads_(threads) {}

  // To be called before Bullet moves anything, while its marks of changed topology still stand.
  void begin_step(const Bodies& bodies);
  Changes read(const Bodies& bodies, double dt, const Fill& fill);
  // Where the response put soft bodies out of what was read of the obstacles, reads that too and
  // takes the response back. True where there was anything to read: the topology is another then.
  bool read_where_pushed();
  // Whether anything may come within `distance` metres of what it may meet, by the bounds of bodies
  // in the motion as it was read.
  bool may_meet(double distance) const;
  // So that the next step knows what was put elsewhere in between.
  void remember_ends();
  void forget_ends() { last_ends_.clear(); }
  // As Obstacles has it.
  void leave_behind(const btCollisionObject& object) { obstacles_.leave_behind(object); }
  // The next step reads the soft bodies, or everything, anew.
  void forget_scene() { scene_.invalidate(); }
  void forget() {
    scene_.invalidate();
    obstacles_.clear();
  }

  const SoftScene& scene() const { return scene_; }
  const StepTopology& topology() const { return topology_; }
  Motion& motion() { return motion_; }
  const Motion& motion() const { return motion_; }
  // Metres: the narrowest gap that neither the rounding of positions nor what the response leaves
  // open closes, and so the least thickness.
  double resolution() const { return resolution_; }

 private:
  struct LastEnd {
    const btSoftBody* body;
    int proxy_id;                     // says which bodies are new where memory is reused
    std::vector<btScalar> positions;  // of its vertices
  };

  struct LastObstacle {
    int unique_id;  // as in Obstacles::Record
    btTransform end;
  };

  // What a pass over the nodes of one body finds.
  struct Found {
    AxisBox swept = AxisBox::empty();
    bool pinned_as_read = true;
    std::int32_t excluded = -1;  // the vertex of a position that is none
  };

  bool gather_soft(double dt, const Fill& fill);
  void gather_block(const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last,
                    const Fill& fill, Found& found);
  void exclude(std::int32_t vertex);
  // Pinned nodes that an application puts elsewhere between two steps are swept from where the last
  // step left them. True where other nodes are elsewhere: that is a new start.
  bool sweep_driven_nodes();
  // Metres by which triangles may lie inside of what is round.
  double depth_in_obstacles() const;
  // True where an obstacle came near, or a dynamic one is elsewhere than the last step left it.
  bool are_others_near() const;
  void gather_obstacles();
  AxisBox bounds_of(const RigidMotion& rigid) const;
  std::size_t index_of(const SoftScene::BodyRecord& record) const {
    return static_cast<std::size_t>(&record - scene_.bodies().data());
  }
  // Of the bodies that meet obstacles.
  AxisBox starts_near_obstacles() const;
  // What dynamic bodies carry: of the nodes with anchors, those that something else moves.
  void find_anchored();
  void read_resolution();

  SolverOptions options_;
  WarningLog& warnings_;
  Threads threads_;
  double resolution_ = 0;
  SoftScene scene_;
  Obstacles obstacles_;
  StepTopology topology_;
  Motion motion_;
  std::vector<AxisBox> bounds_;                // of what each body sweeps, in the topology's order
  AxisBox swept_ = AxisBox::empty();           // of the soft bodies' vertices in this step
  AxisBox near_obstacles_ = AxisBox::empty();  // of those that meet obstacles, with their margin
  std::vector<LastEnd> last_ends_;             // empty where the last step is not known
  std::vector<LastObstacle> last_obstacles_;   // sorted, of that step
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
