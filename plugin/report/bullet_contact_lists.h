// Contacts of a step in Bullet's own lists, as Bullet fills them. Bullet's solver has run already,
// so only applications read them.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include "lazyccd/bullet/report.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Rigid world: appends to m_scontacts and m_rcontacts of the bodies in contact.
void fill_soft_contact_lists(Span<const StepContact> contacts);

/// Deformable world: clears m_faceNodeContacts of `bodies`, then appends to it and to
/// m_nodeRigidContacts.
void fill_deformable_contact_lists(btAlignedObjectArray<btSoftBody*>& bodies,
                                   Span<const StepContact> contacts);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
