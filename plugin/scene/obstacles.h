// The rigid bodies near the soft ones as triangles that move rigidly.
// Of meshes, terrains and planes the part near the soft bodies is read, and read again where these
// leave it.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "util/warning_log.h"
#include "lazyccd/scene.h"
#include "scene/rigid_poses.h"
#include "scene/tessellation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Obstacles {
 public:
  using SoftBodies = btAlignedObjectArray<btSoftBody*>;

  struct Record : RigidPose {
    const btCollisionShape* shape;
    btVector3 scaling;
    int revision;                 // of a compound's children
    std::array<btScalar, 6> box;  // of the shape in its own frame: an application may change it
    int group, mask;
    std::uint64_t ignored;
    bool dynamic;
    bool responds;                      // to contact; false: it only carries
    bool has_anchored_nodes = false;               // dynamic, with nodes of soft bodies by anchors
    AxisBox region = AxisBox::empty();  // that its triangles were read from, in its own frame
    std::shared_ptr<const Triangles> triangles;  // null where they are to be read
    std::int32_t first_vertex = 0, vertex_count = 0;
  };

  // Soft bodies with one of Bullet's flags for rigid bodies, clusters aside.
  static bool meets_obstacles(const btSoftBody& body);

  // An obstacle all of whose surface is known as triangles, and whose mass is known.
  static bool is_whole(const btCollisionObject& object);

  // To be called before Bullet moves anything.
  void begin_step(const SoftBodies& bodies);
  // With rigid bodies where the step ends, the soft bodies' motion in `swept`, and how deep inside
  // round surfaces triangles may lie, as tessellate() has it. True if triangles must be read:
  // read_triangles() is to be called then.
  bool update(const SoftBodies& bodies, const AxisBox& swept, double depth, WarningLog& warnings);
  // The same for a larger `swept` in the same step.
  bool update_region(const AxisBox& swept);
  // Whether all that is in `swept` was read in this step.
  bool has_read(const AxisBox& swept) const;
  // Makes new vertices and faces. `starts`: bounds of where the soft bodies' motion starts.
  void read_triangles(const AxisBox& starts, WarningLog& warnings);
  // As RigidPoses has it.
  void leave_behind(const btCollisionObject& object) { poses_.leave_behind(object); }
  // Drops everything.
  void clear();

  const std::vector<Record>& records() const { return records_; }
  std::int32_t vertex_count() const { return static_cast<std::int32_t>(local_.size()); }
  // In a body's own frame, by vertex.
  const std::vector<btVector3>& local() const { return local_; }
  const std::vector<Face>& faces() const { return faces_; }

 private:
  void read_triangles(Record& record, const AxisBox& near, WarningLog& warnings) const;
  void append_triangles(Record& record);

  RigidPoses poses_;
  std::vector<const btCollisionObject*> carriers_;  // sorted
  std::vector<Record> records_;  // those near the soft bodies, and what carries nodes of them
  AxisBox region_ = AxisBox::empty();
  double depth_ = 0;       // metres, that triangles are to be read for
  double read_depth_ = 0;  // and were
  std::vector<btVector3> local_;
  std::vector<Face> faces_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
