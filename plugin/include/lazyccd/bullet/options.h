// What an application may choose about the adapter. The defaults suit cloth in metres and seconds.
//
// Which bodies collide is Bullet's to say: filter groups and masks, an overlap filter callback,
// setIgnoreCollisionCheck() and m_collisionDisabledObjects hold for soft bodies as for rigid ones.
// A body collides with itself after setSelfCollision(true). Pairs with the cluster flag CL_SS in
// common stay with Bullet. A body with CF_NO_CONTACT_RESPONSE has its contacts reported and nothing
// moved. The flags VF_SS and VF_DD are not needed. Bullet's trees of faces, which it builds in
// quadratic time, and for ever for a body of several components, are built where Bullet's contacts
// first read them; rayTest() still has Bullet build one. Those of nodes in the deformable world are
// as Bullet last read them. One solver serves one world.
//
// A number that is not finite or negative where that means nothing is said, and the default used.
#pragma once

#include <functional>
#include <string>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/detector.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct SolverOptions {
  DetectorOptions detector;

  // The gap in metres that a contact leaves between two surfaces where there was as much before it.
  // Negative: the sum of the two bodies' collision margins, as Bullet does.
  double thickness = -1;
  // A contact whose gap is narrower than the thickness opens it by this part of the thickness each
  // step, by moving nodes without giving them velocity.
  double position_correction = 0.05;
  // Of contacts that meet at `restitution_threshold` m/s or faster, from 0 (they stay together)
  // to 1.
  double restitution = 0;
  double restitution_threshold = 0.2;
  // Coulomb's friction with the bodies' own coefficients; false: none.
  bool friction = true;

  // Rigid bodies take part: meshes, terrains and planes, and convex shapes as the polyhedra of
  // their surfaces; dynamic ones give way. False: they are Bullet's alone.
  bool collide_rigid = true;
  // Contacts of soft bodies with them are LazyCCD's alone: bodies rest on the triangles at the sum
  // of the margins. Bullet's own hold slow nodes only, and never let them rest on a mesh, of whose
  // triangles it makes prisms of 6 cm to both sides. They go on where LazyCCD does not know enough:
  // for solids of tetrahedra, whose inner nodes have no surface, and for links of multi-bodies.
  // False: both act everywhere.
  bool replace_rigid_contacts = true;

  // Soft bodies in contact that deform more slowly than `rest_speed` m/s (root mean square;
  // Bullet's sleeping threshold) lose that motion at up to `rest_damping` 1/s, so that they come to
  // rest. What moves as a whole goes on. 0: they tremble for longer.
  double rest_speed = 0.04;
  double rest_damping = 20;

  // Soft bodies that intersect where a scene begins, or are put into each other or into rigid ones,
  // move out at up to this speed, m/s, without gaining velocity, until three seconds bring nothing
  // more. 1 m/s suits cloth in metres. 0: what is on the wrong side stays there.
  double untangling_speed = 0;

  int max_detections = 20;  // detections a step that are answered with impulses
  // Gauss-Seidel sweeps over the contacts after each of them, at most; four times as many where all
  // contacts meet more slowly than 0.25 m/s, as at rest, and a fifth to open gaps.
  int solver_iterations = 100;
  int max_impact_zones = 8;  // then: detections answered with rigid impact zones

  // Called at the end of each step that had contacts, with positions and velocities as Bullet goes
  // on with them. Bodies may come and go in the call; the span is valid until they do.
  std::function<void(Span<const StepContact>)> on_contacts;

  // Called once for each new line of the solver's status(): input that had to be left out,
  // failures.
  std::function<void(const std::string&)> on_message;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
