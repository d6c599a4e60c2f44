// Updates Bullet's bounding volume trees (btDbvt) over the nodes and faces of soft bodies only when
// Bullet reads them. Bullet needs them for its own passes over pairs, most of which LazyCCD takes
// over. By itself, Bullet builds the tree of nodes again in each step. It builds the tree of faces
// in time quadratic in the faces, and never finishes for a body in several components. So the face
// trees that its passes over rigid bodies read are built here.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <unordered_set>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SoftBodyDbvt {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;

  /// Call at the start of a step, while Bullet's marks of changed topology are still set. Until
  /// end_prediction(), bodies do not request face trees that nothing reads yet, or that Bullet
  /// would never finish. `request_flag`: the collision flag that requests a face tree.
  /// `bullet_handles_pairs`: Bullet handles the pairs of soft bodies in this step.
  void begin_prediction(Bodies& bodies, int request_flag, bool bullet_handles_pairs);
  /// Also hides the node trees until end_prediction(), so that Bullet does not update them.
  void hide_nodes(Bodies& bodies);
  /// Says that a prediction updates the node trees of these bodies only when Bullet reads them.
  void leave_out_nodes(Span<btSoftBody* const> bodies) {
    left_out_.assign(bodies.begin(), bodies.end());
    outdated_node_trees_.clear();
  }
  /// Restores the flags and trees. Call after Bullet's prediction.
  void end_prediction();

  /// Update the trees that Bullet reads when it collides a soft body with `other`, or two soft
  /// bodies. Call before that.
  void update_trees(btSoftBody& body, const btCollisionObject& other);
  void update_trees(btSoftBody& a, btSoftBody& b);

  /// Builds and updates the trees as Bullet would have them by now, with the face tree if its
  /// `request_flag` is set. A request that is still pending is left to Bullet's next prediction.
  static void build_trees(btSoftBody& body, int request_flag);

 private:
  void update_node_tree(btSoftBody& body);

  struct Hidden {
    btSoftBody* body;
    btDbvtNode* root;
  };

  int request_flag_ = 0;
  /// Bodies whose request_flag_ is off until end_prediction().
  std::vector<btSoftBody*> suspended_requests_;
  std::vector<Hidden> hidden_;  ///< until end_prediction()
  /// Bodies whose node tree is from an earlier step. `left_out_` joins the others when the first
  /// one is updated: in most steps none is.
  std::vector<btSoftBody*> left_out_;
  std::unordered_set<btSoftBody*> outdated_node_trees_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
