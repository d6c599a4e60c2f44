// SolverOptions: what an application can choose about the Bullet adapter. The defaults suit cloth
// in metres and seconds. One solver serves one world.
//
// Which bodies collide follows Bullet's own settings:
//  - Filter groups and masks, an overlap filter callback, setIgnoreCollisionCheck() and
//    m_collisionDisabledObjects apply to soft bodies as they do to rigid bodies.
//  - A body collides with itself after setSelfCollision(true).
//  - Two soft bodies collide if both have the flag VF_SS, or both VF_DD. If CL_SS (clusters) is the
//    only soft-soft flag that both bodies have, the pair stays with Bullet.
//  - A soft body collides with everything rigid if it has SDF_RS, or SDF_RD with SDF_RDN. SDF_RD
//  with
//    SDF_RDF asks for rigid bodies, SDF_RD with SDF_MDF for links of multibodies. Bodies with CL_RS
//    stay with Bullet.
//  - Contacts of a soft body with CF_NO_CONTACT_RESPONSE are reported, but nothing is moved. A
//    rigid body with this flag is no obstacle.
//
// Bullet's trees of bounding boxes: Bullet builds a tree of faces in quadratic time, and never
// finishes if the mesh has several components. The adapter builds it instead, and only when
// Bullet's own contacts first read it. Exception: rayTest() still makes Bullet build one. In the
// deformable world, node trees may be one step old for the application.
#pragma once

#include <functional>
#include <string>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/detector.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Options of both solvers. If a number below is not finite or outside its range, on_message and
/// status() name it, and the default is used.
struct SolverOptions {
  /// Backend, threads and traversal of the detector. The threads also serve the rest of the step;
  /// 0: all or one, as ThreadChoice decides. `separation` and `reduce_contacts` are ignored: the
  /// adapter sets them.
  DetectorOptions detector;

  /// Gap that a contact keeps between two surfaces, metres; never wider than the gap at the start
  /// of the step. Negative: the sum of the two bodies' collision margins, as in Bullet.
  double thickness = -1;

  /// Position correction (Baumgarte), per second. A contact whose gap is below half the thickness
  /// restores this share of what is missing in a second. This moves nodes without changing their
  /// velocities (split impulses). 0: no correction.
  double position_correction = 2;

  /// Coefficient of restitution, from 0 (bodies stay together) to 1. Applies to contacts that meet
  /// at `restitution_threshold` or faster.
  double restitution = 0;
  double restitution_threshold = 0.2;  ///< m/s, >= 0

  /// true: friction with the bodies' own coefficients; false: no friction. In the deformable world
  /// it is Coulomb's, as Bullet's. In the rigid world a contact holds inside Coulomb's cone; faster
  /// ones lose a fraction of their sliding speed, as in Bullet (SlidingFriction in
  /// pair_surfaces.h).
  bool friction = true;
  /// true: Coulomb's friction in the rigid world too. What slides on a surface of coefficient mu
  /// then loses at most mu g of speed per second, and goes farther than with Bullet.
  bool coulomb_friction = false;

  /// true: rigid bodies and links of multibodies are obstacles. Meshes, terrains and planes take
  /// part with their triangles, convex shapes as polyhedra. Contacts push dynamic bodies and links.
  /// false: only Bullet handles them.
  bool collide_rigid = true;

  /// true: bodies collide only as the collision flags of the soft bodies ask (see above). false:
  /// all soft bodies collide with each other and with rigid bodies, except by clusters.
  bool obey_collision_flags = true;

  /// true: LazyCCD's soft-rigid contacts replace Bullet's. false: both act.
  /// Bullet's still act for tetrahedral bodies without faces, and for shapes with parts that have
  /// no triangles. Reason: with Bullet's contacts cloth never rests on a mesh, because each
  /// triangle becomes a prism of 6 cm on both sides.
  bool replace_rigid_contacts = true;

  /// Soft bodies that carry load in contact lose velocity of deformation if its root mean square is
  /// below `rest_speed`, m/s, >= 0. The slower they deform, the stronger the damping. This
  /// brings them to rest. Rigid motion of the body is not damped, and load that slides under
  /// Coulomb's friction does not count. The default is Bullet's sleeping threshold. 0: no damping;
  /// bodies tremble for longer.
  double rest_speed = 0.04;
  double rest_damping = 20;  ///< highest rate of that damping, 1/s, >= 0; 0: no damping

  /// How long contacts may make a link of the rigid world, as a multiple of its rest length, >= 0;
  /// less than 1 counts as 1. A link that is longer at the start of the step may stay so. It holds
  /// in bodies with tetrahedra that touch something, and under weights. It holds where one contact
  /// moves a node by more than 0.7 of its shortest edge, and where what touches was not near
  /// before. Fast impacts, and weights of ten times a cloth and more, stretch links farther. 0: no
  /// limit.
  double strain_limit = 2;

  /// Speed at which intersecting bodies are moved apart, m/s, >= 0. Acts on scenes that begin with
  /// intersections, and on bodies that the application puts into others. What is deep inside of a
  /// rigid body comes out faster, at six times its depth a second. Velocities do not change. Ends
  /// after three seconds without progress. 0: intersections stay as they are.
  double untangling_speed = 0.5;

  /// true: near contacts of two bodies are searched again only after one of them has moved, by
  /// 1.4 % of the thickness. Meanwhile contacts keep their normals and their places on the
  /// surfaces. false: they are searched in each step. Nothing passes through in either case.
  bool contact_cache = true;

  /// true: contacts stand in Bullet's own lists after the step, such as m_rcontacts. Only
  /// applications read them. false: these lists stay empty, which takes less time; on_contacts and
  /// contacts() have the contacts in either case.
  bool fill_contact_lists = true;

  /// true: StepStats::energy_gained and energy_lost are measured, which reads all nodes twice more
  /// in each step. false: they stay 0. Nothing moves differently.
  bool measure_energy = false;

  /// Largest number of rounds "solve impulses, detect again" per step, >= 0. 0: no impulses at all.
  int max_impulse_rounds = 20;
  /// Normal limit of Gauss-Seidel iterations per solve, >= 0; a solve ends sooner when the changes
  /// are negligible. The limit is 4 times this number if all contacts meet more slowly than 0.25
  /// m/s, or if the last impulses suffice to 0.02 m/s (at rest). It is 1/5 for split impulses.
  int solver_iterations = 100;
  /// Then, largest number of rounds "join the contacts in rigid impact zones, detect again", >= 0.
  /// If contacts remain after these, the fail-safe holds the bodies' nodes at the start of the
  /// step.
  int max_zone_rounds = 8;

  /// Speed, m/s, >= 0, up to which a displacement counts as motion although nothing explains it. An
  /// application may put bodies elsewhere between steps or in Bullet's callbacks. A displacement is
  /// a motion if the velocity of the body explains it (for kinematic bodies: the velocity that
  /// Bullet computes from their motion states), or the displacement of the step before, or if no
  /// point moves faster than this. It is swept then: nothing passes through the body. Any other
  /// displacement is a jump, and so are nodes that the application writes, unless only pinned nodes
  /// move: nothing is swept, and what intersects at the new place is moved apart. The solvers'
  /// teleported() makes the next displacement of a body a jump whatever its size.
  double jump_speed = 5;

  /// Called at the end of each step that had contacts, when positions and velocities are the ones
  /// that Bullet continues with. The callback may add and remove bodies; the span is valid until it
  /// does. An exception from the callback is caught and reported in status().
  std::function<void(Span<const StepContact>)> on_contacts;

  /// Called once for each new line of the solver's status(): input that is left out, and failures.
  std::function<void(const std::string&)> on_message;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
