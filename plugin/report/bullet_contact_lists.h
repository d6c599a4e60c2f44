// Contacts of a step in Bullet's own lists, as Bullet fills them. Bullet's solver has run already,
// so only applications read them.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include "lazyccd/bullet/report.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Bullet clears the lists of active bodies when a step begins. Those of a sleeping body stay as
// they were when it fell asleep, until it has other contacts.
void clear_soft_contact_lists(btSoftBody& body);
void clear_deformable_contact_lists(btSoftBody& body);

/// Rigid world: appends to m_scontacts and m_rcontacts of the bodies in contact.
void fill_soft_contact_lists(Span<const StepContact> contacts);

/// Deformable world: appends to m_faceNodeContacts and m_nodeRigidContacts, and to
/// m_faceRigidContacts of bodies whose flags ask Bullet for them (SDF_RDF, SDF_MDF).
void fill_deformable_contact_lists(Span<const StepContact> contacts);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
