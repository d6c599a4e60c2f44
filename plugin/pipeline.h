// One step of a scene of soft bodies: gather, detect, respond. Shared by the solvers of all worlds,
// which read and write Bullet's nodes in their own way. Nothing here throws.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "journal.h"
#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "motion.h"
#include "obstacles.h"
#include "response.h"
#include "soft_scene.h"
#include "step_detector.h"
#include "step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Pipeline {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;
  // Fills start, end and velocity of some of a soft body's vertices, first to last - 1, rate where
  // it is not one over the step, and zeroes the inverse mass of nodes that something else than
  // velocity and contact moves.
  using Fill = std::function<void(const SoftScene&, const SoftScene::BodyRecord&,
                                  std::int32_t first, std::int32_t last, Motion&)>;

  // Bullet's rule of this world for the friction between two soft bodies.
  using Friction = double (*)(double kdf_a, double kdf_b);

  Pipeline(const Options& options, Friction friction);

  // A pair from Bullet's dispatcher. False where it is not LazyCCD's, so that Bullet is to process
  // it.
  bool queue_pair(const btSoftBody* a, const btSoftBody* b) noexcept;
  // A soft body and a rigid one whose contacts are LazyCCD's alone.
  bool takes(const btSoftBody* body, const btCollisionObject* rigid) const noexcept;
  // To be called before Bullet moves anything, while its marks of changed topology still stand.
  void begin_step(const Bodies& bodies) noexcept;

  // The whole scene, `seconds` long. True where it went its full way: then motion().end is clean
  // and is what the nodes should be set to. False where the step is Bullet's alone; status() says
  // why.
  bool run(const Bodies& bodies, double seconds, const Fill& fill) noexcept;

  // Of the last run():
  bool works() const { return works_; }
  const SoftScene& scene() const { return scene_; }
  const Motion& motion() const { return motion_; }
  // The response moved this vertex, or changed its velocity. Only where it responded().
  bool is_moved(std::int32_t vertex) const;
  bool responded() const { return responded_; }
  // Gives rigid bodies what the response made of their motion.
  void write_rigid_bodies() const;
  const std::vector<StepContact>& contacts() const { return contacts_; }
  // Tells the application's listener, when nodes and velocities are those of the end of the step.
  void announce() noexcept;
  const StepStats& step() const { return step_; }

  const StepStats& total() const { return total_; }
  std::string status() const;
  void invalidate() {
    scene_.invalidate();
    obstacles_.clear();
  }
  Journal& journal() { return journal_; }

 private:
  struct LastEnd {
    int proxy_id;                     // of a soft body
    std::vector<btScalar> positions;  // of its vertices
  };

  PairSurface surface(std::int32_t body_a, std::int32_t body_b) const;
  void gather(const Bodies& bodies, double seconds, const Fill& fill);
  bool gather_soft(double seconds, const Fill& fill);
  bool gather_block(const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last,
                    const Fill& fill, AxisBox& swept);
  void refuse(const SoftScene::BodyRecord& record, std::int32_t vertex);
  // Pinned nodes that an application puts elsewhere between two steps are swept from where the last
  // step left them. True where other nodes are elsewhere: that is a new start.
  bool sweep_driven_nodes();
  void remember_ends();
  void gather_obstacles();
  // Where the response put soft bodies out of what was read of the obstacles, reads that too and
  // takes the response back.
  bool read_where_pushed();
  // True where the resolution is another than before.
  bool read_resolution();
  void set_topology();
  void report_piercings();
  void leave_stopped_obstacles();
  std::int32_t body_index(const StepTopology::BodyRecord& body) const;
  double largest_thickness() const;
  void collect_contacts();

  Options options_;
  Friction friction_;
  Journal journal_;
  // Metres: the narrowest gap that neither the rounding of positions nor what the response leaves
  // open closes, and so the least thickness.
  double resolution_ = 0;
  SoftScene scene_;
  Obstacles obstacles_;
  StepTopology topology_;
  Motion motion_;
  AxisBox swept_ = AxisBox::empty();           // of the soft bodies' vertices in this step
  AxisBox near_obstacles_ = AxisBox::empty();  // of those that meet obstacles, with their margin
  StepDetector detector_;
  Response response_;
  std::vector<LastEnd> last_ends_;  // empty where the last step is not known
  std::vector<StepContact> contacts_;
  std::int64_t queued_ = 0;
  StepStats step_, total_;
  bool works_ = true;
  bool responded_ = false;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
