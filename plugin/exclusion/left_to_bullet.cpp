#include "exclusion/left_to_bullet.h"

#include <string>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

bool is_fraction(btScalar x) { return x >= 0 && x <= 1; }

bool has_stiffness_out_of_range(const btSoftBody& body) {
  for (int i = 0; i < body.m_materials.size(); ++i) {
    const btSoftBody::Material& material = *body.m_materials[i];
    if (!is_fraction(material.m_kLST) || !is_fraction(material.m_kAST) ||
        !is_fraction(material.m_kVST))
      return true;
  }
  return false;
}

}  // namespace

void warn_of_what_is_left_to_bullet(const btSoftBody& body, int world_index, WarningLog& warnings) {
  const std::string name = "soft body " + std::to_string(world_index);
  constexpr int clusters = btSoftBody::fCollision::CL_RS | btSoftBody::fCollision::CL_SS;
  if (body.m_cfg.collisions & clusters)
    warnings.warn_once("clusters " + name,
                       name +
                           ": its clusters (CL_RS, CL_SS) collide as with Bullet alone; use "
                           "SDF_RS and VF_SS, or SDF_RD and VF_DD, for contacts of its surface");
  if (body.m_deformableAnchors.size() > 0)
    warnings.warn_once("anchors " + name,
                       name +
                           ": its anchors are Bullet's, which keep the mass matrix of where "
                           "they were made; make them anew when the rigid body has turned far");
  if (has_stiffness_out_of_range(body))
    warnings.warn_once("materials " + name,
                       name +
                           ": a stiffness of its materials (m_kLST, m_kAST, m_kVST) is outside "
                           "of [0, 1], so Bullet's links may explode; set it within");
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
