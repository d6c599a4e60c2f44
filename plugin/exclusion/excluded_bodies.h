// Soft bodies that collision detection leaves out, because contacts of theirs would mean nothing.
//
// Such a body pushes nothing and costs nothing: the solver does not hand its pairs to Bullet
// either. Bullet still moves it. It takes part again when it is right again.
#pragma once

#include <BulletSoftBody/btDeformableLagrangianForce.h>
#include <BulletSoftBody/btSoftBody.h>

#include <unordered_map>
#include <vector>

#include "lazyccd/bullet/report.h"
#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ExcludedBodies {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;
  using Forces = btAlignedObjectArray<btDeformableLagrangianForce*>;

  /// Starts a step. Takes back bodies that are right again, and excludes those whose bounds
  /// overflow and those with inverted tetrahedra. `forces`: of a deformable world; null in others.
  void begin_step(const Bodies& bodies, const Forces* forces, WarningLog& warnings);
  /// Excludes a body until it is right again. `node`: one that shows why, or -1. `largest_speed`:
  /// for unresolved_step, the speed of this node at which the body is right again, m/s.
  void add(btSoftBody& body, int world_index, int node, ExclusionReason reason,
           WarningLog& warnings, double largest_speed = 0);
  bool contains(const btSoftBody* body) const;
  std::vector<ExcludedBody> all() const { return {excluded_.begin(), excluded_.end()}; }

 private:
  struct Entry : ExcludedBody {
    double largest_speed;  // as in add()
    bool is_still_wrong() const;
  };
  // Tells new bodies from those whose tetrahedra were looked at.
  struct Signs {
    int proxy_id, tetra_count;
  };

  void find_inverted(const Bodies& bodies, const Forces& forces, WarningLog& warnings);

  std::vector<Entry> excluded_;                           // in the order in which they were found
  std::unordered_map<const btSoftBody*, Signs> elastic_;  // bodies with elastic tetrahedra
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
