// Bullet's own constraints within soft bodies, solved by Bullet in an order that processors like,
// and of several bodies at once.
//
// Bullet goes over the links one after the other, and grids list those beside each other that share
// a node, so that each waits for the one before. Bullet's ReoptimizeLinkOrder() puts others between
// them, and none before one that it depends on: the result is the same to the bit. But applications
// know links by their index, so they have that order only while they are solved, when no other
// thread must read them.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SoftConstraints {
 public:
  // As btDefaultSoftBodySolver::solveConstraints(). Where it throws (std::bad_alloc), bodies are as
  // they were, or solved.
  void solve(const btAlignedObjectArray<btSoftBody*>& bodies, const ParallelFor& parallel_for);

 private:
  // The order of a body's links.
  struct Order {
    int count = -1;          // of the links that it was found for
    int waiting = 0;         // links that wait for one just before them less than in the body's own
    std::vector<int> index;  // in the body's own order, by place
    std::vector<std::array<const btSoftBody::Node*, 2>> ends;  // by place
  };

  using Links = std::vector<btSoftBody::Link>;

  void solve(btSoftBody& body, int index);
  static bool pays(const btSoftBody& body, const Order& order);
  static Order find_order(const btSoftBody& body);
  static bool put_in_order(btSoftBody& body, const Order& order, const Links& links);
  static void put_back(btSoftBody& body, const Order& order, Links& links);

  std::vector<Order> orders_;  // by body
  std::vector<Links> links_;   // by body: those that are solved, in the body's own order
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
