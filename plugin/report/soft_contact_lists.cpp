#include "report/bullet_contact_lists.h"
#include "report/contact_fields.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void clear_soft_contact_lists(btSoftBody& body) {
  body.m_scontacts.resize(0);
  body.m_rcontacts.clear();
}

void fill_soft_contact_lists(Span<const StepContact> contacts) {
  for (btSoftBody* const body : sleepers_with(contacts)) clear_soft_contact_lists(*body);
  // Fills the list as Bullet's CollideVF_SS does (btSoftBodyInternals.h). Bullet's solver has
  // finished this step and clears the list before the next one. So only applications read it.
  for (const StepContact& contact : contacts) {
    btSoftBody* const node_body = btSoftBody::upcast(contact.body_a);
    if (!node_body || contact.kind != ContactKind::vertex_face) continue;
    if (!contact.face) {
      append_rigid_contact(contact, *node_body, node_body->m_rcontacts).m_node = contact.nodes[0];
      continue;
    }
    const btSoftBody& a = *node_body;
    const btSoftBody& b = *btSoftBody::upcast(contact.body_b);
    btSoftBody::SContact c;
    c.m_node = contact.nodes[0];
    c.m_face = contact.face;
    c.m_weights = face_weights(contact);
    c.m_normal = contact.normal;
    c.m_margin = a.getCollisionShape()->getMargin() + b.getCollisionShape()->getMargin();
    c.m_friction = btMax(a.m_cfg.kDF, b.m_cfg.kDF);
    const btScalar node_share = contact.nodes[0]->m_im;
    btScalar face_share = 0;
    for (int k = 0; k < 3; ++k) face_share += c.m_weights[k] * contact.nodes[k + 1]->m_im;
    const btScalar shares = node_share + face_share;
    c.m_cfm[0] = shares > 0 ? node_share / shares * a.m_cfg.kSHR : 0;
    c.m_cfm[1] = shares > 0 ? face_share / shares * b.m_cfg.kSHR : 0;
    node_body->m_scontacts.push_back(c);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
