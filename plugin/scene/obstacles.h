// Obstacles: the rigid bodies near the soft ones, as triangles that move rigidly.
//
// Only the part of a mesh, terrain or plane near the soft bodies is read. It is read again when the
// soft bodies leave that part. What lies near them is decided for each soft body (read_regions.h).
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include "lazyccd/scene.h"
#include "scene/rigid_poses.h"
#include "shapes/read_regions.h"
#include "shapes/tessellation.h"
#include "util/scratch_vector.h"
#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Obstacles {
 public:
  using SoftBodies = btAlignedObjectArray<btSoftBody*>;
  using Boxes = ScratchVector<AxisBox>;

  /// One obstacle: a rigid body near the soft bodies, or one that nodes are anchored to.
  struct Record : RigidPose {
    const btCollisionShape* shape;
    btVector3 scaling;
    std::uint64_t surface;      ///< hash of a compound's children, a hull's points, and the margin
    std::uint64_t child_poses;  ///< hash
    /// Bounding box of the shape in its own frame. Shows that an application changed the shape.
    std::array<btScalar, 6> box;
    int group, mask;
    std::uint64_t ignored;  ///< hash_of_ignored()
    bool dynamic;
    bool responds;  ///< false: no contact response; it only moves the nodes anchored to it
    bool has_anchored_nodes = false;  ///< dynamic, and nodes of soft bodies are anchored to it
    std::uint32_t step = 0;           ///< that it was made in
    bool is_changed = false;  ///< its shape, or what it collides with, is not that of the last step
    AxisBox region = AxisBox::empty();  ///< its triangles were read from here; in its own frame
    std::shared_ptr<const Triangles> triangles;  ///< null until they are read
    /// If children of a compound have moved in the step: where its leaves were at the start, and
    /// the vertices of `triangles` with them, in its own frame. Otherwise null.
    std::shared_ptr<const std::vector<Triangles::Leaf>> last_leaves;
    std::shared_ptr<const std::vector<btVector3>> last_vertices;
    std::int32_t first_vertex = 0, vertex_count = 0;
  };

  /// True if the whole surface of an obstacle is known as triangles. False for bodies without
  /// contact response and for shapes without triangles.
  static bool is_fully_known(const btCollisionObject& object);

  /// `jump_speed`: as in SolverOptions.
  explicit Obstacles(btScalar jump_speed) : poses_(jump_speed), jump_speed_(jump_speed) {}

  /// Starts a step. Call it before Bullet moves anything.
  void begin_step(const SoftBodies& bodies);
  /// Reads the poses of the rigid bodies at the end of the step. `dt`: its length, seconds.
  void read_poses(const SoftBodies& bodies, double dt, WarningLog& warnings);
  /// See RigidPoses::let_driven_jump().
  void let_driven_jump(const AxisBox& box) { poses_.let_driven_jump(box); }
  /// Bounds, over the step, of the rigid bodies with contact response that move, are new or were
  /// put elsewhere.
  Boxes moving_bounds() const;
  /// Finds the rigid bodies near the soft ones. `swept`: bounds of each soft body's motion.
  /// `depth`: how deep inside round surfaces triangles may lie, metres; see tessellate(). Returns
  /// true if triangles must be read; call read_triangles() then.
  bool update(const SoftBodies& bodies, const Boxes& swept, double depth, WarningLog& warnings);
  /// The same for a larger `swept` in the same step.
  bool update_regions(const Boxes& swept, WarningLog& warnings);
  /// True if all triangles in `swept` have been read.
  bool has_read(const Boxes& swept) const;
  /// Makes new vertices and faces. `starts`: bounds of each soft body at the start of the step.
  void read_triangles(const Boxes& starts, WarningLog& warnings);
  /// Makes update() read the whole meshes of an obstacle and not only the part near the soft
  /// bodies. `unique_id`: as in RigidPose.
  void read_whole_mesh(int unique_id) { read_whole_.insert(unique_id); }
  /// Ends that.
  void read_parts_of_meshes() { read_whole_.clear(); }
  bool reads_whole_mesh(const Record& record) const {
    return read_whole_.count(record.unique_id) > 0;
  }
  /// See RigidPoses::teleported().
  void teleported(const btCollisionObject& object) { poses_.teleported(object); }
  /// See RigidPoses::hold_at_start(). Children of a compound that moved are held too.
  void hold_at_start(const btCollisionObject& object);
  /// Makes the next update() read everything again, and forgets the poses of the last step.
  void invalidate();

  const std::vector<Record>& records() const { return records_; }
  /// See RigidPoses.
  void set_response_end(int unique_id, const btTransform& end) {
    poses_.set_response_end(unique_id, end);
  }
  void take_link_ends() { poses_.take_link_ends(); }
  /// See RigidPoses::start_of().
  const MultibodyPose* start_of(const btMultiBody& body) const { return poses_.start_of(body); }
  std::int32_t vertex_count() const { return static_cast<std::int32_t>(local_positions_.size()); }
  /// Positions in the bodies' own frames, by vertex.
  const std::vector<btVector3>& local_positions() const { return local_positions_; }
  const std::vector<Face>& faces() const { return faces_; }

 private:
  // Bounds, in the obstacle's frame, of the triangles that must be known for what is in `boxes`.
  AxisBox needed_region(const Record& record, Span<const AxisBox> boxes) const;
  void read_triangles(Record& record, const AxisBox& near, WarningLog& warnings) const;
  void append_triangles(Record& record);
  bool keeps_triangles(const Record& record, const Record& last) const;
  // Sets last_vertices. If children have moved faster than jump_speed, marks the record as changed
  // instead.
  void sweep_children(Record& record) const;

  RigidPoses poses_;
  btScalar jump_speed_;
  btScalar dt_ = 0;  // seconds
  std::uint32_t step_ = 0;
  std::vector<const btCollisionObject*> anchor_objects_;  // with anchored nodes; sorted
  std::vector<Record> records_;                           // sorted by unique_id
  std::vector<Record> next_records_;                      // scratch memory, empty
  ReadRegions regions_;                                   // world frame: triangles are read there
  std::set<int> read_whole_;                              // unique_id of obstacles
  double depth_ = 0;       // of update(): for the next reading of triangles, metres
  double read_depth_ = 0;  // of the last reading, metres
  std::vector<btVector3> local_positions_;
  std::vector<Face> faces_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
