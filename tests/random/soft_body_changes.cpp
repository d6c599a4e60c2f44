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

double lightest_node(const btSoftBody& body) {
  double lightest = 1e30;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    if (body.m_nodes[i].m_im > 0)
      lightest = std::min(lightest, 1 / static_cast<double>(body.m_nodes[i].m_im));
  }
  return lightest;
}

// A random set of the collision flags that Bullet's demos use; it need not make sense.
int any_flags(RandomSource& random) {
  int flags = 0;
  for (const int flag : {Flag::SDF_RS, Flag::CL_RS, Flag::SDF_RD, Flag::SDF_RDF, Flag::SDF_RDN,
                         Flag::VF_SS, Flag::CL_SS, Flag::CL_SELF, Flag::VF_DD}) {
    if (random.chance(0.4)) flags |= flag;
  }
  return flags;
}

int any_iterations(RandomSource& random) {
  const int seldom[] = {0, 30, 60};
  return random.chance(0.9) ? 1 + random.below(10) : seldom[random.below(3)];
}

// Nearly all coefficients lie between 0 and 1.
double friction(RandomSource& random) {
  const double usual = random.uniform();
  return random.chance(0.9) ? usual : random.chance(0.5) ? 0 : 10;
}

void add_wind(btSoftBody& body, double speed, RandomSource& random) {
  using Model = btSoftBody::eAeroModel;
  const Model::_ models[] = {Model::V_Point,    Model::V_TwoSided, Model::V_TwoSidedLiftDrag,
                             Model::V_OneSided, Model::F_TwoSided, Model::F_TwoSidedLiftDrag,
                             Model::F_OneSided};
  body.m_cfg.aeromodel = models[random.below(7)];
  body.m_cfg.kDG = scalar(random.uniform(0, 0.1));
  body.m_cfg.kLF = scalar(random.uniform(0, 0.1));
  if (random.chance(0.5))
    body.setWindVelocity(scalar(random.uniform(0, 0.3) * speed) * random.direction());
}

std::string set_up_for_rigid_world(btSoftBody& body, const ChangeLimits& limits,
                                   RandomSource& random) {
  std::string words;
  if (random.chance(0.6)) body.m_cfg.collisions = Flag::SDF_RS | Flag::VF_SS;
  body.m_materials[0]->m_kLST = scalar(random.chance(0.05) ? 0 : random.uniform(0.05, 1));
  body.m_cfg.piterations = any_iterations(random);
  body.m_cfg.kDP = scalar(random.chance(0.5) ? 0 : random.chance(0.9) ? 0.05 : 1);
  if (random.chance(0.2) && body.m_faces.size() > 0 && body.m_nodes.size() > 4)
    body.generateBendingConstraints(2);
  if (random.chance(0.2)) body.randomizeConstraints();
  const double weight = static_cast<double>(body.getTotalMass()) * limits.size;
  if (limits.closed && random.chance(0.3)) body.m_cfg.kPR = scalar(random.uniform(-2, 10) * weight);
  if (limits.closed && random.chance(0.2)) body.m_cfg.kVC = scalar(random.uniform(0, 5) * weight);
  if (body.m_faces.size() > 3 && random.chance(0.15)) {
    body.setPose(random.chance(0.3), true);
    body.m_cfg.kMT = scalar(random.uniform(0, 0.5));
  }
  if (random.chance(0.15)) add_wind(body, limits.speed, random);
  if (random.chance(0.1)) body.m_cfg.diterations = 1 + random.below(3);
  if (random.chance(0.1)) body.m_cfg.viterations = 1 + random.below(3);
  if (random.chance(0.05)) {
    body.m_cfg.timescale = scalar(random.uniform(0.3, 1));
    words += " slow";
  }
  if (body.m_faces.size() > 3 && random.chance(0.06)) {
    body.generateClusters(1 + random.below(6));
    body.m_cfg.collisions = Flag::CL_SS | Flag::CL_RS;
    if (random.chance(0.5)) body.m_cfg.collisions |= Flag::CL_SELF;
    words += " clusters";
  }
  if (random.chance(0.1)) {
    body.m_cfg.collisions = any_flags(random);
    words += " flags=" + std::to_string(body.m_cfg.collisions);
  }
  return words;
}

std::string set_up_for_deformable_world(btSoftBody& body, RandomSource& random) {
  body.m_cfg.collisions = Flag::SDF_RD | Flag::VF_DD;
  if (random.chance(0.7)) body.m_cfg.collisions |= Flag::SDF_RDN;
  if (random.chance(0.3)) body.m_cfg.collisions |= Flag::SDF_RDF;
  body.m_cfg.kKHR = body.m_cfg.kCHR = 1;
  if (random.chance(0.8)) body.m_sleepingThreshold = 0;
  if (random.chance(0.1)) body.m_cfg.drag = scalar(random.uniform(0, 0.1));
  if (random.chance(0.1)) body.setDampingCoefficient(scalar(random.uniform(0, 0.1)));
  if (!random.chance(0.1)) return "";
  body.m_cfg.collisions = any_flags(random);
  return " flags=" + std::to_string(body.m_cfg.collisions);
}

// True if Bullet can cut the body. It cuts links and faces, but not tetrahedra. It does not extend
// a pose for new nodes, and clusters keep dangling pointers to the old nodes.
bool may_be_cut(btSoftBody& body, const RandomWorld& world) {
  const bool posed = body.m_pose.m_bvolume || body.m_pose.m_bframe;
  const bool clustered = body.m_clusters.size() > 0;
  return world.is_rigid() && body.m_links.size() > 0 && body.m_tetras.size() == 0 && !posed &&
         !clustered && !body.useSelfCollision();
}

// Cuts the body along a random plane through a node.
void cut_across(btSoftBody& body, int node, RandomSource& random) {
  struct Plane : btSoftBody::ImplicitFn {
    btVector3 normal, point;
    btScalar Eval(const btVector3& x) override { return normal.dot(x - point); }
  } plane;
  plane.normal = random.direction();
  plane.point = body.m_nodes[node].m_x;
  btVector3 lower, upper;
  body.getAabb(lower, upper);
  body.refine(&plane, scalar(1e-3) * lower.distance(upper), true);
}

}  // namespace

std::string set_up(btSoftBody& body, const ChangeLimits& limits, RandomWorld& world,
                   RandomSource& random) {
  std::string words;
  body.setTotalMass(scalar(random.across_scales(1e-2, 1e2)), false);
  if (random.chance(0.15)) {
    const double spread = random.chance(0.2) ? 1e3 : 10;
    for (int i = 0; i < body.m_nodes.size(); ++i)
      body.setMass(i, body.getMass(i) * scalar(random.across_scales(1 / spread, spread)));
    words += " masses";
  }
  if (random.chance(0.2)) {
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      if (random.chance(0.15)) body.setMass(i, 0);
    }
    words += " pinned";
  }
  if (random.chance(0.8)) body.setActivationState(DISABLE_DEACTIVATION);
  body.m_cfg.kDF = scalar(friction(random));
  return words + (world.is_rigid() ? set_up_for_rigid_world(body, limits, random)
                                   : set_up_for_deformable_world(body, random));
}

std::string add_forces(btSoftBody& body, const ChangeLimits& limits, RandomWorld& world,
                       RandomSource& random) {
  if (world.is_rigid()) return "";
  // As stiff as explicit integration allows.
  const double lightest = lightest_node(body), dt = limits.step;
  const double k = std::min(0.03 * lightest / (dt * dt), 1000.0);
  const double damping = random.uniform(0, 0.02) * lightest / dt;
  const bool conserving = random.chance(0.3);
  const double bending = random.chance(0.2) ? 0.2 * k : -1;
  world.add_force(body, std::make_unique<btDeformableMassSpringForce>(scalar(k), scalar(damping),
                                                                      conserving, scalar(bending)));
  world.add_force(body, std::make_unique<btDeformableGravityForce>(world.gravity()));
  if (body.m_tetras.size() == 0 || random.chance(0.5)) return "";
  const btScalar stiffness = scalar(0.002 * lightest / (dt * dt * limits.size));
  switch (random.below(3)) {
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

std::string change(btSoftBody& body, const ChangeLimits& limits, const RandomWorld& world,
                   RandomSource& random) {
  const btVector3 velocity = scalar(limits.speed * random.uniform()) * random.direction();
  const int node = random.below(body.m_nodes.size());
  switch (random.below(22)) {
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
                                          scalar(random.across_scales(0.1, 10)));
      return "margin";
    case 6:
      body.forceActivationState(random.chance(0.5) ? ISLAND_SLEEPING : ACTIVE_TAG);
      return "sleep";
    case 7:
      body.setTotalMass(body.getTotalMass() * scalar(random.across_scales(1, 10)));
      return "heavy";
    case 8:
      for (int i = 0; i < body.m_nodes.size(); ++i) {
        if (body.getMass(i) > 0) body.setMass(i, body.getMass(i) * scalar(random.uniform(0.5, 2)));
      }
      return "masses";
    case 9: {
      const btVector3 force =
          scalar(0.1 * static_cast<double>(body.getMass(node)) / limits.step) * velocity;
      body.addForce(force, node);
      return "";
    }
    case 10:
      body.m_cfg.kDF = scalar(friction(random));
      return "";
    case 11:
      body.setWindVelocity(velocity);
      return "wind";
    case 12:
      if (!world.is_rigid()) return "";
      body.setRestLengthScale(scalar(random.uniform(0.7, 1.3)));
      return "rest";
    case 13:
      if (!may_be_cut(body, world)) return "";
      {
        const btSoftBody::Link& link = body.m_links[random.below(body.m_links.size())];
        const int a = static_cast<int>(link.m_n[0] - &body.m_nodes[0]);
        const int b = static_cast<int>(link.m_n[1] - &body.m_nodes[0]);
        body.cutLink(a, b, scalar(random.uniform(0.1, 0.9)));
      }
      return "cut";
    case 14: {
      const int other = random.below(body.m_nodes.size());
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
      cut_across(body, node, random);
      return "refine";
    case 18:
      if (!world.is_rigid() || body.m_faces.size() < 4) return "";
      body.setPose(random.chance(0.3), true);
      body.m_cfg.kMT = scalar(random.uniform(0, 0.5));
      return "pose";
    case 19:
      body.m_cfg.piterations = any_iterations(random);
      body.m_cfg.viterations = random.below(5);
      body.m_cfg.diterations = random.below(5);
      return "iterations";
    case 20:
      if (body.m_tetras.size() == 0) return "";
      body.setVolumeMass(scalar(random.across_scales(0.01, 100)));
      return "volume";
    default:
      if (!limits.closed || !(body.getVolume() > 0)) return "";
      body.setTotalDensity(scalar(random.across_scales(0.1, 10)));
      return "density";
  }
}

}  // namespace lazyccd::test
