// Bullet's trees over the nodes and faces of a body are for its own passes over pairs, of which
// LazyCCD takes most. So they are made when Bullet comes to read them. Bullet makes one of nodes
// anew in each step; one of faces it builds in time quadratic in the faces, and never finishes that
// of a body in several components, so those that its passes over rigid bodies read are built here.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SoftBodyDbvt {
 public:
  using Bodies = btAlignedObjectArray<btSoftBody*>;

  // To be called where a step begins, before Bullet's marks of changed topology are gone. Until
  // end_prediction(), bodies do not ask for trees of faces that nothing reads yet, or that Bullet
  // would never finish. `request`: the flag that asks for one. `bullets_pairs`: Bullet is to handle
  // soft pairs.
  void begin_prediction(Bodies& bodies, int request, bool bullets_pairs);
  // Also hides the trees of nodes, which Bullet would make anew.
  void hide_nodes(Bodies& bodies);
  void end_prediction();

  // To be called before Bullet collides the body with something: `other` null for a soft one.
  void bring_up_to_date(btSoftBody& body, const btCollisionObject* other);

 private:
  struct Hidden {
    btSoftBody* body;
    btDbvtNode* root;
  };

  int request_ = 0;
  std::vector<btSoftBody*> asking_;     // of which the request was taken, until end_prediction()
  std::vector<btSoftBody*> faceless_;   // whose trees of faces were left out, and may be built
  std::vector<Hidden> hidden_;          // until end_prediction()
  std::vector<btSoftBody*> old_nodes_;  // whose trees of nodes are of an earlier step
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
