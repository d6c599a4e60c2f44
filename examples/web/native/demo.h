// A scene of the page, as it is stepped, drawn and pulled at.
#pragma once

#include <memory>
#include <vector>

#include "scenes.h"
#include "scenes/measures/crossings.h"

namespace lazyccd::web {

/// One body for drawing, in the world's frame.
struct Drawn {
  bool is_soft = false;
  std::vector<std::int32_t> faces;
  std::vector<float> positions;  ///< x, y, z of each vertex; those of a soft body are its nodes
};

class Demo {
 public:
  Demo(const scenes::SceneInfo& info, scenes::Collisions collisions, double speed, double size);

  void step();
  /// Counts pass-throughs since the last call, between all soft bodies and with all obstacles.
  /// Convex ones count as polyhedra of 95 % of their size. Returns the sum of all calls.
  std::int64_t count();
  bool is_finite() const;
  /// Puts the bodies where they are now into drawn().
  void draw();
  const std::vector<Drawn>& drawn() const { return drawn_; }
  /// Points of contacts that carry an impulse, and points 5 cm along their normals; x, y, z each.
  const std::vector<float>& contact_lines();

  /// Pulls a node of a soft body, and those linked to it, towards a point from now on.
  void grab(int soft_body, int node);
  void drag(const btVector3& goal) { goal_ = goal; }
  void let_go() { grabbed_.clear(); }

  const scenes::PhysicsWorld& world() const { return *scene_.world; }

 private:
  std::vector<btScalar> counted_positions() const;

  scenes::Scene scene_;
  std::unique_ptr<scenes::CrossingCounter> counter_;
  std::vector<Drawn> drawn_;
  std::vector<float> lines_;
  std::vector<btSoftBody::Node*> grabbed_;  // first the node itself
  btVector3 goal_;
};

}  // namespace lazyccd::web
