// Reports of a step: its statistics and its contacts.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <cstdint>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Counts and times of one step, or their sums over several steps.
struct StepStats {
  std::int64_t steps = 0;
  /// Steps that the calling thread ran alone, because other threads would not have helped enough.
  /// Steps of a solver with one thread do not count.
  std::int64_t single_thread_steps = 0;
  std::int64_t soft_bodies = 0;      ///< soft bodies that took part
  std::int64_t sleeping_bodies = 0;  ///< soft bodies that slept and were left out
  std::int64_t handled_pairs = 0;    ///< pairs of soft bodies that came from Bullet's dispatcher
  std::int64_t detections = 0;       ///< detections and re-checks, also those without a search
  /// First detections that were left out, because near contacts of earlier steps still held.
  std::int64_t cached_detections = 0;
  std::int64_t started_ahead = 0;  ///< detections that began before Bullet had solved the step
  std::int64_t rechecks = 0;       ///< re-checks of near pairs, for the response or the report
  /// Of `rechecks`: those that also searched for other pairs, where the motion had changed much.
  std::int64_t searches_again = 0;
  std::int64_t candidates = 0;         ///< elementary pairs that the first detection tested
  std::int64_t listed_candidates = 0;  ///< of `candidates`: those that a Verlet list had
  std::int64_t near_pairs = 0;         ///< pairs that came near each other in the first detection
  std::int64_t contacts_vf = 0;        ///< distinct vertex-face pairs in contact
  std::int64_t contacts_ee = 0;        ///< distinct edge-edge pairs in contact
  std::int64_t contact_rows = 0;       ///< contacts on which the solver's impulses could act
  std::int64_t islands = 0;            ///< groups of bodies that these contacts connect
  std::int64_t sweeps = 0;             ///< sweeps of the solver over all contacts that act
  std::int64_t strained_links = 0;     ///< links that SolverOptions::strain_limit held
  std::int64_t impact_zone_nodes = 0;  ///< nodes that moved rigidly with an impact zone
  /// Nodes and rigid bodies that the fail-safe held where the step began: members of contacts that
  /// nothing else resolved, or of whole bodies. Other members of their impact zones are held too,
  /// but not counted. A kinematic body is held if it closes in on something that cannot move.
  /// Bullet's body then goes on, and LazyCCD's obstacle stays behind until there is room.
  std::int64_t failsafe_holds = 0;
  /// Number of contacts, not of nodes, left at the end of the step, which even the fail-safe could
  /// not end: a moving kinematic body passed over pinned nodes, or other nodes that cannot move.
  std::int64_t unresolved = 0;
  std::int64_t initial_contacts = 0;  ///< pairs in contact that touched before the step began
  /// Edge-face intersections at the start of the step. Counted in the first step, and in steps
  /// before which bodies changed or were placed elsewhere: pairs with one of these bodies; all
  /// pairs while others are moved apart.
  std::int64_t initial_intersections = 0;
  std::int64_t fallback_steps = 0;  ///< steps that ran without LazyCCD; status() says why
  /// Joules by which the response raised and lowered the kinetic energy of soft and dynamic rigid
  /// bodies. The net change of each step counts in one of the two; neither is negative. Both are 0
  /// without SolverOptions::measure_energy.
  double energy_gained = 0, energy_lost = 0;
  /// Milliseconds for reading Bullet's nodes, for detections, for the response, for writing nodes.
  double ms_gather = 0, ms_detect = 0, ms_response = 0, ms_write = 0;

  StepStats& operator+=(const StepStats& s);

  /// Calls visit(name, member) for each member; `member` is a pointer to it.
  template <class Visit>
  static void for_each_member(const Visit& visit);
};

template <class Visit>
void StepStats::for_each_member(const Visit& visit) {
  visit("steps", &StepStats::steps);
  visit("single_thread_steps", &StepStats::single_thread_steps);
  visit("soft_bodies", &StepStats::soft_bodies);
  visit("sleeping_bodies", &StepStats::sleeping_bodies);
  visit("handled_pairs", &StepStats::handled_pairs);
  visit("detections", &StepStats::detections);
  visit("cached_detections", &StepStats::cached_detections);
  visit("started_ahead", &StepStats::started_ahead);
  visit("rechecks", &StepStats::rechecks);
  visit("searches_again", &StepStats::searches_again);
  visit("candidates", &StepStats::candidates);
  visit("listed_candidates", &StepStats::listed_candidates);
  visit("near_pairs", &StepStats::near_pairs);
  visit("contacts_vf", &StepStats::contacts_vf);
  visit("contacts_ee", &StepStats::contacts_ee);
  visit("contact_rows", &StepStats::contact_rows);
  visit("islands", &StepStats::islands);
  visit("sweeps", &StepStats::sweeps);
  visit("strained_links", &StepStats::strained_links);
  visit("impact_zone_nodes", &StepStats::impact_zone_nodes);
  visit("failsafe_holds", &StepStats::failsafe_holds);
  visit("unresolved", &StepStats::unresolved);
  visit("initial_contacts", &StepStats::initial_contacts);
  visit("initial_intersections", &StepStats::initial_intersections);
  visit("fallback_steps", &StepStats::fallback_steps);
  visit("energy_gained", &StepStats::energy_gained);
  visit("energy_lost", &StepStats::energy_lost);
  visit("ms_gather", &StepStats::ms_gather);
  visit("ms_detect", &StepStats::ms_detect);
  visit("ms_response", &StepStats::ms_response);
  visit("ms_write", &StepStats::ms_write);
}

/// Why a soft body takes no part in collision detection.
enum class ExclusionReason {
  not_finite,      ///< a position
  overflow,        ///< its bounds are larger than Bullet accepts, which disables it for that
  inverted,        ///< around a node, tetrahedra at rest that a force acts on are inverted
  unresolved_step  ///< a node moves 500 m in a step, or so far that its coordinates cannot resolve
                   ///< a tenth of the thickness
};

/// A soft body that the last step left out. It pushes nothing. It takes part again when it is right
/// again.
struct ExcludedBody {
  btSoftBody* body;
  int node;  ///< a node that shows the reason, or -1 if the whole body does
  ExclusionReason reason;
};

/// One contact of a step: a vertex and a face, or two edges, that touched or that an impulse kept
/// apart. The pointers are valid until bodies or their topology change.
struct StepContact {
  ContactKind kind;
  btCollisionObject* body_a;  ///< soft (btSoftBody::upcast) or rigid; at least one is soft
  btCollisionObject* body_b;
  /// vertex_face: the vertex, of body_a, then the three of the face, of body_b. edge_edge: the two
  /// ends of the edge of body_a, then those of body_b. Null for vertices of a rigid body.
  std::array<btSoftBody::Node*, 4> nodes;
  btSoftBody::Face* face;         ///< of body_b; null for edge_edge, and if body_b is rigid
  std::array<double, 4> weights;  ///< of the four vertices, sum zero; see Contact::weights()
  btVector3 normal;               ///< unit vector from b to a, world frame
  btVector3 point;                ///< on b, at the end of the step; metres, world frame
  double toi;      ///< from 0 to 1 of the step: when the pair first touched or came near
  double impulse;  ///< N s, along the normal, from b on a; never negative
  btVector3 friction_impulse;  ///< N s, perpendicular to the normal, from b on a
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
