// What a step did, for applications that want to know.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <array>
#include <cstdint>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Counts and times of one step, or summed over steps.
struct StepStats {
  std::int64_t steps = 0;
  std::int64_t handled_pairs = 0;  // soft pairs that Bullet's dispatcher handed over
  std::int64_t detections = 0;
  std::int64_t started_ahead = 0;     // of these, those that began before Bullet had solved
  std::int64_t contacts_vf = 0;  // different pairs of primitives in contact
  std::int64_t contacts_ee = 0;
  std::int64_t impact_zone_nodes = 0;  // nodes that had to move rigidly with an impact zone
  // Nodes and rigid bodies held where the step began. A kinematic body among them closes in on what
  // cannot give way: Bullet's goes on, and LazyCCD's is left behind until there is room.
  std::int64_t failsafe_holds = 0;
  // Contacts that even those could not end: of a moving kinematic body with a pinned node in its
  // way, alone or in an edge or a face.
  std::int64_t unresolved = 0;
  std::int64_t initial_contacts = 0;  // pairs in contact that touched before the step began
  // Edges that stuck in faces when the scene was read: in its first step, and where it changed.
  std::int64_t initial_intersections = 0;
  std::int64_t fallback_steps = 0;  // steps that went on without LazyCCD (see status())
  // Joules by which the response raised and lowered the kinetic energy of soft and dynamic rigid
  // bodies, each step's change counted on its side.
  double energy_gained = 0, energy_lost = 0;
  // Of reading Bullet's nodes, detections, the response and writing nodes.
  double ms_gather = 0, ms_detect = 0, ms_response = 0, ms_write = 0;

  StepStats& operator+=(const StepStats& s);
};

// One contact of a step: a vertex and a face, or two edges, that touched or that an impulse kept
// apart. The pointers are valid until bodies or their topology change.
struct StepContact {
  ContactKind kind;
  btCollisionObject* body_a;  // soft (btSoftBody::upcast) or rigid; at least one is soft
  btCollisionObject* body_b;
  // vertex_face: the vertex, of a, then the face's three, of b; edge_edge: the ends of a's edge,
  // then of b's. Null for those of a rigid body.
  std::array<btSoftBody::Node*, 4> nodes;
  btSoftBody::Face* face;         // of body_b; null for edge_edge and of a rigid body
  std::array<double, 4> weights;  // of the four vertices, sum zero: as Contact::weights()
  btVector3 normal;               // unit, in the world, from b to a
  btVector3 point;                // metres, in the world, at the end of the step, on b
  double toi;                  // of the step, from 0 to 1: when the pair first touched or came near
  double impulse;              // N s, along the normal: what a received from b, never negative
  btVector3 friction_impulse;  // N s, across the normal: what a received from b
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
