// Undoes intersections that a scene begins with, of soft bodies with each other, with themselves
// and with rigid ones, by moving the soft ones. Detection in continuous time keeps them as they
// are: what is on the wrong side may not come back either.
//
// Where edges that stick in faces cut off a piece of a surface, the edges move back through the
// faces: what is inside of another body's closed surface is on the wrong side, and of all others
// the smaller piece. Where they cut nothing off, each moves so that the line in which the surfaces
// meet becomes shorter (Volino and Magnenat-Thalmann 2006, "Resolving surface collisions through
// intersection contour minimization"). Of the contacts of such pairs those are let pass that lead
// there; all others stop motion as ever.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "untangling/intersections.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ClosedSurfaces;

class Untangling {
 public:
  Untangling();
  ~Untangling();

  // A scene begins that intersects.
  void start();
  // False where nothing is left to undo, or three seconds have undone nothing: what then moves on
  // would never rest.
  bool goes_on() const { return fewest_ > 0; }

  // For the start of a step, of whose topology and edges `found` has indices.
  void begin_step(const Intersections& found, const Topology& topology, Span<const Edge> edges,
                  const Motion& motion);
  // The same once more, where the indices of the step change.
  void read(const Intersections& found, const Topology& topology, Span<const Edge> edges,
            const Motion& motion);
  // For a step in which nothing is to be undone.
  void skip_step();
  // Moves the ends of the step by at most `distance`, metres, without velocity.
  void push(double distance, Motion& motion) const;
  bool pushes() const { return !pushes_.empty(); }
  bool is_pushed(std::int32_t vertex) const { return pushes_.count(vertex) > 0; }
  bool lets_any_pass() const { return !ways_.empty(); }
  // It would stop what is to be undone.
  bool lets_pass(const Contact& contact, const Motion& motion) const;

 private:
  using Vector = Eigen::Vector3d;

  // `way`: how the edge is to go against the face.
  void add(const Edge& edge, const Face& face, const Vector& way, const Motion& motion);
  bool comes_out(const Contact& contact, const Vector& normal, const Motion& motion) const;

  std::map<std::int32_t, Vector> pushes_;  // by soft vertex
  // How the first vertex is to go against the second, by pairs of one of an edge and one of a face.
  std::map<std::pair<std::int32_t, std::int32_t>, Vector> ways_;
  std::unique_ptr<const ClosedSurfaces> closed_;
  std::size_t fewest_ = 0;  // pairs in any step since the start
  double waited_ = 0;       // seconds since there were as few
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
