#include "random/soft_body_changes.h"

#include <BulletSoftBody/btDeformableCorotatedForce.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>

#include <algorithm>

namespace lazyccd::test {
namespace {

using Flag = btSoftBody::fCollision;

btScalar scalar(double x) { return static_cast<btScalar>(x); }

double lightest_node(const btSoftBody& body) {
  double lightest = 1e30;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    if (body.m_nodes[i].m_im > 0)
      lightest = std::min(lightest, 1 / static_cast<double>(body.m_nodes[i].m_im));
  }
  return lightest;
}

// Of all that Bullet's demos draw from, however little sense it makes.
int any_flags(Dice& dice) {
  int flags = 0;
  for (const int flag : {Flag::SDF_RS, Flag::CL_RS, Flag::SDF_RD, Flag::SDF_RDF, Flag::SDF_RDN,
                         Flag::VF_SS, Flag::CL_SS, Flag::CL_SELF, Flag::VF_DD}) {
    if (dice.chance(0.4)) flags |= flag;
  }
  return flags;
}

int any_iterations(Dice& dice) {
  const int seldom[] = {0, 30, 60};
  return dice.chance(0.9) ? 1 + dice.below(10) : seldom[dice.below(3)];
}

// Nearly all coefficients lie between 0 and 1.
double friction(Dice& dice) {
  const double usual = dice.uniform();
  return dice.chance(0.9) ? usual : dice.chance(0.5) ? 0 : 10;
}

void into_the_wind(btSoftBody& body, double speed, Dice& dice) {
  using Model = btSoftBody::eAeroModel;
  const Model::_ models[] = {Model::V_Point,    Model::V_TwoSided, Model::V_TwoSidedLiftDrag,
                             Model::V_OneSided, Model::F_TwoSided, Model::F_TwoSidedLiftDrag,
                             Model::F_OneSided};
  body.m_cfg.aeromodel = models[dice.below(7)];
  body.m_cfg.kDG = scalar(dice.uniform(0, 0.1));
  body.m_cfg.kLF = scalar(dice.uniform(0, 0.1));
  if (dice.chance(0.5))
    body.setWindVelocity(scalar(dice.uniform(0, 0.3) * speed) * dice.direction());
}

std::string set_up_for_rigid_world(btSoftBody& body, const Manner& manner, Dice& dice) {
  std::string words;
  if (dice.chance(0.6)) body.m_cfg.collisions = Flag::SDF_RS | Flag::VF_SS;
  body.m_materials[0]->m_kLST = scalar(dice.chance(0.05) ? 0 : dice.uniform(0.05, 1));
  body.m_cfg.piterations = any_iterations(dice);
  body.m_cfg.kDP = scalar(dice.chance(0.5) ? 0 : dice.chance(0.9) ? 0.05 : 1);
  if (dice.chance(0.2) && body.m_faces.size() > 0 && body.m_nodes.size() > 4)
    body.generateBendingConstraints(2);
  if (dice.chance(0.2)) body.randomizeConstraints();
  const double weight = static_cast<double>(body.getTotalMass()) * manner.size;
  if (manner.closed && dice.chance(0.3)) body.m_cfg.kPR = scalar(dice.uniform(-2, 10) * weight);
  if (manner.closed && dice.chance(0.2)) body.m_cfg.kVC = scalar(dice.uniform(0, 5) * weight);
  if (body.m_faces.size() > 3 && dice.chance(0.15)) {
    body.setPose(dice.chance(0.3), true);
    body.m_cfg.kMT = scalar(dice.uniform(0, 0.5));
  }
  if (dice.chance(0.15)) into_the_wind(body, manner.speed, dice);
  if (dice.chance(0.1)) body.m_cfg.diterations = 1 + dice.below(3);
  if (dice.chance(0.1)) body.m_cfg.viterations = 1 + dice.below(3);
  if (dice.chance(0.05)) {
    body.m_cfg.timescale = scalar(dice.uniform(0.3, 1));
    words += " slow";
  }
  if (body.m_faces.size() > 3 && dice.chance(0.06)) {
    body.generateClusters(1 + dice.below(6));
    body.m_cfg.collisions = Flag::CL_SS | Flag::CL_RS;
    if (dice.chance(0.5)) body.m_cfg.collisions |= Flag::CL_SELF;
    words += " clusters";
  }
  if (dice.chance(0.1)) {
    body.m_cfg.collisions = any_flags(dice);
    words += " flags=" + std::to_string(body.m_cfg.collisions);
  }
  return words;
}

std::string set_up_for_deformable_world(btSoftBody& body, Dice& dice) {
  body.m_cfg.collisions = Flag::SDF_RD | Flag::VF_DD;
  if (dice.chance(0.7)) body.m_cfg.collisions |= Flag::SDF_RDN;
  if (dice.chance(0.3)) body.m_cfg.collisions |= Flag::SDF_RDF;
  body.m_cfg.kKHR = body.m_cfg.kCHR = 1;
  if (dice.chance(0.8)) body.m_sleepingThreshold = 0;
  if (dice.chance(0.1)) body.m_cfg.drag = scalar(dice.uniform(0, 0.1));
  if (dice.chance(0.1)) body.setDampingCoefficient(scalar(dice.uniform(0, 0.1)));
  if (!dice.chance(0.1)) return "";
  body.m_cfg.collisions = any_flags(dice);
  return " flags=" + std::to_string(body.m_cfg.collisions);
}

// Bullet cuts links and faces, not tetrahedra, makes no room for new nodes in a pose, and lets
// clusters keep pointers to where the nodes were.
bool may_be_cut(btSoftBody& body, const RandomWorld& world) {
  const bool posed = body.m_pose.m_bvolume || body.m_pose.m_bframe;
  const bool clustered = body.m_clusters.size() > 0;
  return world.is_rigid() && body.m_links.size() > 0 && body.m_tetras.size() == 0 && !posed &&
         !clustered && !body.useSelfCollision();
}

// Along a plane through a node.
void cut_across(btSoftBody& body, int node, Dice& dice) {
  struct Plane : btSoftBody::ImplicitFn {
    btVector3 normal, point;
    btScalar Eval(const btVector3& x) override { return normal.dot(x - point); }
  } plane;
  plane.normal = dice.direction();
  plane.point = body.m_nodes[node].m_x;
  btVector3 lower, upper;
  body.getAabb(lower, upper);
  body.refine(&plane, scalar(1e-3) * lower.distance(upper), true);
}

}  // namespace

std::string set_up(btSoftBody& body, const Manner& manner, RandomWorld& world, Dice& dice) {
  std::string words;
  body.setTotalMass(scalar(dice.across_scales(1e-2, 1e2)), false);
  if (dice.chance(0.15)) {
    const double spread = dice.chance(0.2) ? 1e3 : 10;
    for (int i = 0; i < body.m_nodes.size(); ++i)
      body.setMass(i, body.getMass(i) * scalar(dice.across_scales(1 / spread, spread)));
    words += " masses";
  }
  if (dice.chance(0.2)) {
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      if (dice.chance(0.15)) body.setMass(i, 0);
    }
    words += " pinned";
  }
  if (dice.chance(0.8)) body.setActivationState(DISABLE_DEACTIVATION);
  body.m_cfg.kDF = scalar(friction(dice));
  return words + (world.is_rigid() ? set_up_for_rigid_world(body, manner, dice)
                                   : set_up_for_deformable_world(body, dice));
}

std::string add_forces(btSoftBody& body, const Manner& manner, RandomWorld& world, Dice& dice) {
  if (world.is_rigid()) return "";
  // As stiff as an explicit step stands.
  const double lightest = lightest_node(body), dt = manner.step;
  const double k = std::min(0.03 * lightest / (dt * dt), 1000.0);
  const double damping = dice.uniform(0, 0.02) * lightest / dt;
  const bool conserving = dice.chance(0.3);
  const double bending = dice.chance(0.2) ? 0.2 * k : -1;
  world.add_force(body, std::make_unique<btDeformableMassSpringForce>(scalar(k), scalar(damping),
                                                                      conserving, scalar(bending)));
  world.add_force(body, std::make_unique<btDeformableGravityForce>(world.gravity()));
  if (body.m_tetras.size() == 0 || dice.chance(0.5)) return "";
  const btScalar stiffness = scalar(0.002 * lightest / (dt * dt * manner.size));
  switch (dice.below(3)) {
    case 0:
      world.add_force(body, std::make_unique<btDeformableCorotatedForce>(stiffness, stiffness));
      return " corotated";
    case 1:
      world.add_force(body, std::make_unique<btDeformableLinearElasticityForce>(
                                stiffness, stiffness, scalar(0.01)));
      return " linear";
    default:
      world.add_force(
          body, std::make_unique<btDeformableNeoHookeanForce>(stiffness, stiffness, scalar(0.01)));
      return " neo-hookean";
  }
}

std::string change(btSoftBody& body, const Manner& manner, const RandomWorld& world, Dice& dice) {
  const btVector3 velocity = scalar(manner.speed * dice.uniform()) * dice.direction();
  const int node = dice.below(body.m_nodes.size());
  switch (dice.below(22)) {
    case 0:
      body.addVelocity(velocity);
      return "";
    case 1:
      if (body.m_nodes[node].m_im > 0) body.m_nodes[node].m_v += velocity;
      return "";
    case 2:
      body.setVelocity(velocity);
      return "velocity";
    case 3:
      body.setMass(node, body.getMass(node) > 0 ? 0 : scalar(0.01));
      body.m_nodes[node].m_v.setZero();
      return "pin";
    case 4:
      body.setSelfCollision(false);
      return "";
    case 5:
      body.getCollisionShape()->setMargin(body.getCollisionShape()->getMargin() *
                                          scalar(dice.across_scales(0.1, 10)));
      return "margin";
    case 6:
      body.forceActivationState(dice.chance(0.5) ? ISLAND_SLEEPING : ACTIVE_TAG);
      return "sleep";
    case 7:
      body.setTotalMass(body.getTotalMass() * scalar(dice.across_scales(1, 10)));
      return "heavy";
    case 8:
      for (int i = 0; i < body.m_nodes.size(); ++i) {
        if (body.getMass(i) > 0) body.setMass(i, body.getMass(i) * scalar(dice.uniform(0.5, 2)));
      }
      return "masses";
    case 9: {
      const btVector3 force =
          scalar(0.1 * static_cast<double>(body.getMass(node)) / manner.step) * velocity;
      body.addForce(force, node);
      return "";
    }
    case 10:
      body.m_cfg.kDF = scalar(friction(dice));
      return "";
    case 11:
      body.setWindVelocity(velocity);
      return "wind";
    case 12:
      if (!world.is_rigid()) return "";
      body.setRestLengthScale(scalar(dice.uniform(0.7, 1.3)));
      return "rest";
    case 13:
      if (!may_be_cut(body, world)) return "";
      {
        const btSoftBody::Link& link = body.m_links[dice.below(body.m_links.size())];
        const int a = static_cast<int>(link.m_n[0] - &body.m_nodes[0]);
        const int b = static_cast<int>(link.m_n[1] - &body.m_nodes[0]);
        body.cutLink(a, b, scalar(dice.uniform(0.1, 0.9)));
      }
      return "cut";
    case 14: {
      const int other = dice.below(body.m_nodes.size());
      if (world.is_rigid() && other != node && body.m_faces.size() > 0)
        body.appendLink(node, other, nullptr, true);
      return "link";
    }
    case 15:
      if (world.is_rigid()) body.randomizeConstraints();
      return "";
    case 16:
      body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
      return "ghost";
    case 17:
      if (!may_be_cut(body, world) || body.m_faces.size() == 0) return "";
      cut_across(body, node, dice);
      return "refine";
    case 18:
      if (!world.is_rigid() || body.m_faces.size() < 4) return "";
      body.setPose(dice.chance(0.3), true);
      body.m_cfg.kMT = scalar(dice.uniform(0, 0.5));
      return "pose";
    case 19:
      body.m_cfg.piterations = any_iterations(dice);
      body.m_cfg.viterations = dice.below(5);
      body.m_cfg.diterations = dice.below(5);
      return "iterations";
    case 20:
      if (body.m_tetras.size() == 0) return "";
      body.setVolumeMass(scalar(dice.across_scales(0.01, 100)));
      return "volume";
    default:
      if (!manner.closed || !(body.getVolume() > 0)) return "";
      body.setTotalDensity(scalar(dice.across_scales(0.1, 10)));
      return "density";
  }
}

}  // namespace lazyccd::test
