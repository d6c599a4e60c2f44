#include "random/touching_start.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "random/penetration_check.h"
#include "random/random_options.h"
#include "random/random_source.h"
#include "random/random_world.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/solid.h"
#include "scenes/meshes/tessellation.h"

namespace lazyccd::test {
namespace {

using scenes::Collisions;
using scenes::World;

constexpr double gravity = 9.81, seconds = 0.5;

// One start. Its own frame has y up, and the surface that the body starts on at y = 0.
class Start {
 public:
  Start(std::uint32_t number, World kind, Collisions collisions)
      : random_(number), kind_(kind), world_(kind, collisions, bullet::SolverOptions(), fixed_) {
    // All random numbers come before anything that depends on the collisions.
    choose_place();
    add_obstacle();
    add_body();
  }
  ~Start() {
    auto& world = world_.bullets();
    for (const auto& body : soft_) world_.remove(*body);
    for (const auto& body : rigid_) world.removeRigidBody(body.get());
    if (multibody_) {
      auto& multi = dynamic_cast<btMultiBodyDynamicsWorld&>(world);
      world.removeCollisionObject(collider_.get());
      multi.removeMultiBody(multibody_.get());
    }
  }

  StartReport run() {
    StartReport report;
    report.what = what_;
    const double dt = kind_ == World::rigid ? 1.0 / 60 : 1.0 / 240, at_start = energy();
    report.scale = weight() * size_;
    // The body is lifted out of rounding, or as far as it starts inside.
    report.lift = weight() * (32 * static_cast<double>(std::numeric_limits<btScalar>::epsilon()) *
                                  static_cast<double>(pose_.getOrigin().length()) +
                              2 * std::max(0.0, -offset_));
    for (int i = 0; i < static_cast<int>(seconds / dt); ++i) {
      world_.bullets().stepSimulation(scalar(dt), 0, scalar(dt));
      for (const auto& body : soft_) {
        for (int k = 0; k < body->m_nodes.size(); ++k) {
          const btSoftBody::Node& node = body->m_nodes[k];
          if (!std::isfinite(node.m_x.length2())) report.is_finite = false;
          if (node.m_im > 0)
            report.fastest = std::max(report.fastest, static_cast<double>(node.m_v.length()));
        }
      }
      if (!report.is_finite) break;
      report.gained = std::max(report.gained, energy() - at_start);
    }
    if (report.is_finite) {
      report.fallen = count_fallen();
      PenetrationCheck check;
      check.restart(soft_, obstacles_);
      report.piercing = check.intersections().sum();
    }
    report.status = world_.status();
    return report;
  }

 private:
  void choose_place() {
    size_ = random_.across_scales(0.1, 4);
    margin_ = random_.chance(0.3) ? 0.25 : size_ * random_.across_scales(0.002, 0.1);
    const double distances[] = {0, 0, 1, 10, 100, 1000};
    const double distance = distances[random_.below(6)];
    btQuaternion turn = btQuaternion::getIdentity();
    const int turned = random_.below(4);
    if (turned == 2) turn = btQuaternion(btVector3(0, 0, 1), SIMD_HALF_PI);
    if (turned == 3) turn = random_.rotation();
    pose_ = btTransform(turn, scalar(distance) * random_.direction());
    world_.set_gravity(pose_.getBasis() * btVector3(0, scalar(-gravity), 0));
    const double ulp =
        static_cast<double>(std::numeric_limits<btScalar>::epsilon()) * std::max(distance, size_);
    const int kind_of_offset = random_.below(4);
    offset_ = kind_of_offset < 2    ? 0
              : kind_of_offset == 2 ? ulp
                                    : std::max(ulp, size_ * random_.across_scales(1e-9, 1e-3));
    if (random_.chance(0.5)) offset_ = -offset_;
    char text[200];
    std::snprintf(text, sizeof text, "size %.3g, margin %.3g, offset %.3g, at %.3g m, %s", size_,
                  margin_, offset_, distance,
                  turned < 2    ? "level"
                  : turned == 2 ? "on its side"
                                : "turned");
    what_ = text;
  }

  btVector3 world_of(double x, double y, double z) const {
    return pose_ * btVector3(scalar(x), scalar(y), scalar(z));
  }

  void add_obstacle() {
    const double half = random_.uniform(0.8, 5) * size_, depth = random_.uniform(0.3, 1) * size_;
    top_half_ = half;
    const btVector3 centre(0, scalar(-depth), 0);
    const btVector3 extents(scalar(half), scalar(depth), scalar(half));
    switch (random_.below(11)) {
      case 0:
        return add_rigid("box", std::make_unique<btBoxShape>(extents), centre, Moves::never);
      case 1:
        return add_rigid("kinematic box", std::make_unique<btBoxShape>(extents), centre,
                         Moves::kinematic);
      case 2:
        return add_rigid("heavy box", std::make_unique<btBoxShape>(extents), centre, Moves::freely);
      case 3:
        return add_rigid("plane",
                         std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)),
                         btVector3(0, 0, 0), Moves::never);
      case 4:
        return add_rigid("cylinder", std::make_unique<btCylinderShape>(extents), centre,
                         Moves::never);
      case 5: {
        auto hull = std::make_unique<btConvexHullShape>();
        for (int i = 0; i < 8; ++i)
          hull->addPoint(extents * btVector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
        return add_rigid("hull", std::move(hull), centre, Moves::never);
      }
      case 6: {
        auto compound = std::make_unique<btCompoundShape>();
        const btVector3 part = extents * btVector3(btScalar(0.5), 1, 1);
        parts_.push_back(std::make_unique<btBoxShape>(part));
        for (const btScalar side : {-1, 1}) {
          btTransform at = btTransform::getIdentity();
          at.setOrigin(btVector3(side * part.x(), 0, 0));
          compound->addChildShape(at, parts_.back().get());
        }
        return add_rigid("compound", std::move(compound), centre, Moves::never);
      }
      case 7: {
        mesh_ = std::make_unique<btTriangleMesh>();
        const int count = 2 + random_.below(6);
        const auto at = [&](int i, int k) {
          return btVector3(scalar((2.0 * i / count - 1) * half), 0,
                           scalar((2.0 * k / count - 1) * half));
        };
        for (int i = 0; i < count; ++i) {
          for (int k = 0; k < count; ++k) {
            mesh_->addTriangle(at(i, k), at(i, k + 1), at(i + 1, k + 1));
            mesh_->addTriangle(at(i, k), at(i + 1, k + 1), at(i + 1, k));
          }
        }
        return add_rigid("mesh", std::make_unique<btBvhTriangleMeshShape>(mesh_.get(), true),
                         btVector3(0, 0, 0), Moves::never);
      }
      case 8: {
        constexpr int count = 9;
        heights_.assign(count * count, 0);
        auto terrain = std::make_unique<btHeightfieldTerrainShape>(
            count, count, heights_.data(), btScalar(1), btScalar(-1), btScalar(1), 1, PHY_FLOAT,
            false);
        const btScalar width = scalar(2 * half / (count - 1));
        terrain->setLocalScaling(btVector3(width, 1, width));
        return add_rigid("terrain", std::move(terrain), btVector3(0, 0, 0), Moves::never);
      }
      case 9:
        if (dynamic_cast<btMultiBodyDynamicsWorld*>(&world_.bullets()))
          return add_link(extents, centre);
        return add_rigid("box", std::make_unique<btBoxShape>(extents), centre, Moves::never);
      default: {
        what_ += ", on a pinned cloth";
        const int count = 4 + random_.below(6);
        auto cloth =
            scenes::make_cloth(world_.info(), count, count, mass_of(half), [&](double u, double v) {
              return world_of((2 * u - 1) * half, 0, (2 * v - 1) * half);
            });
        scenes::pin_border(*cloth, count, count);
        add_soft(std::move(cloth), false);
      }
    }
  }

  void add_body() {
    // Below a surface with two sides a body may fall.
    const bool has_two_sides = mesh_ || !soft_.empty();
    if (has_two_sides) offset_ = std::abs(offset_);
    const double s = size_, x0 = random_.uniform(-0.2, 0.2) * s,
                 z0 = random_.uniform(-0.2, 0.2) * s;
    const auto on = [&](double u, double y, double v) {
      return world_of(x0 + (u - 0.5) * s, offset_ + y * s, z0 + (v - 0.5) * s);
    };
    switch (random_.below(5)) {
      case 0:
        what_ += ", cloth of four nodes";
        return add_soft(scenes::make_cloth(world_.info(), 2, 2, mass_of(s),
                                           [&](double u, double v) { return on(u, 0, v); }),
                        false);
      case 1: {
        what_ += ", cloth";
        const int count = 3 + random_.below(9);
        return add_soft(scenes::make_cloth(world_.info(), count, count, mass_of(s),
                                           [&](double u, double v) { return on(u, 0, v); }),
                        false);
      }
      case 2:
        what_ += ", rope";
        return add_soft(scenes::make_rope(world_.info(), 2 + random_.below(12), mass_of(s),
                                          on(0, 0, 0.3), on(1, 0, 0.6)),
                        false);
      case 3:
        what_ += ", shell";
        return add_soft(shell(on), false);
      default:
        what_ += ", tetrahedra";
        // Far from the origin the rounding of positions makes Bullet's elasticity explode.
        return add_soft(
            scenes::make_solid(world_.info(), 1 + random_.below(3), mass_of(s),
                               [&](double u, double v, double w) { return on(u, v, w); }),
            pose_.getOrigin().length() < 100);
    }
  }

  // The surface of a cube.
  template <class On>
  std::unique_ptr<btSoftBody> shell(const On& on) {
    std::vector<btScalar> points;
    for (int i = 0; i < 8; ++i) {
      const btVector3 x = on(i & 1, (i & 2) / 2, (i & 4) / 4);
      for (int k = 0; k < 3; ++k) points.push_back(x[k]);
    }
    const int faces[] = {0, 3, 2, 0, 1, 3, 4, 7, 5, 4, 6, 7, 0, 5, 1, 0, 4, 5,
                         2, 7, 6, 2, 3, 7, 0, 6, 4, 0, 2, 6, 1, 7, 3, 1, 5, 7};
    std::unique_ptr<btSoftBody> body(
        btSoftBodyHelpers::CreateFromTriMesh(world_.info(), points.data(), faces, 12, false));
    for (int i = 0; i < 4; ++i) body->appendLink(i, 7 - i);  // diagonals keep it a cube
    body->setTotalMass(scalar(mass_of(size_)));
    return body;
  }

  static double mass_of(double size) { return size * size; }

  void add_soft(std::unique_ptr<btSoftBody> body, bool is_solid) {
    using Flag = btSoftBody::fCollision;
    body->getCollisionShape()->setMargin(scalar(margin_));
    body->setActivationState(DISABLE_DEACTIVATION);
    if (kind_ == World::rigid) {
      body->m_cfg.piterations = 4;
      body->m_cfg.collisions = Flag::SDF_RS | Flag::VF_SS;
    } else {
      body->m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDN | Flag::VF_DD;
      body->m_cfg.kKHR = body->m_cfg.kCHR = 1;
      body->m_sleepingThreshold = 0;
    }
    if (is_solid) orient_tetrahedra(*body);
    world_.add(*body, 0);
    if (kind_ == World::deformable) {
      const btScalar stiffness = scalar(200 * mass_of(size_) / size_);
      if (is_solid)
        world_.add_force(*body, std::make_unique<btDeformableLinearElasticityForce>(
                                    btScalar(300), btScalar(300), btScalar(0.01), btScalar(0.01)));
      else
        world_.add_force(*body, std::make_unique<btDeformableMassSpringForce>(
                                    stiffness, scalar(0.01) * stiffness, true));
      world_.add_force(*body, std::make_unique<btDeformableGravityForce>(world_.gravity()));
    }
    soft_.push_back(std::move(body));
  }

  // Bullet's elasticity explodes where a tetrahedron has a negative volume.
  static void orient_tetrahedra(btSoftBody& body) {
    for (int i = 0; i < body.m_tetras.size(); ++i) {
      auto& corners = body.m_tetras[i].m_n;
      const btVector3& a = corners[0]->m_x;
      const btVector3 ab = corners[1]->m_x - a, ac = corners[2]->m_x - a, ad = corners[3]->m_x - a;
      if (ab.cross(ac).dot(ad) < 0) std::swap(corners[2], corners[3]);
    }
    body.initializeDmInverse();
    body.m_tetraScratches.resize(body.m_tetras.size());
    body.m_tetraScratchesTn.resize(body.m_tetras.size());
  }

  enum class Moves { never, kinematic, freely };
  void add_rigid(const char* name, std::unique_ptr<btCollisionShape> shape, const btVector3& at,
                 Moves moves) {
    what_ += std::string(", on a ") + name;
    if (!shape->isConcave()) shape->setMargin(scalar(std::min(margin_, 0.04 * size_)));
    btTransform pose = pose_;
    pose.setOrigin(pose_ * at);
    const btScalar mass = moves == Moves::freely ? scalar(1000 * mass_of(size_)) : btScalar(0);
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape.get(), inertia);
    info.m_startWorldTransform = pose;
    auto body = std::make_unique<btRigidBody>(info);
    if (moves == Moves::kinematic)
      body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    world_.add(*body, 0);
    if (moves == Moves::freely) body->setGravity(btVector3(0, 0, 0));
    add_surface(*body, *shape, moves != Moves::freely);
    shapes_.push_back(std::move(shape));
    rigid_.push_back(std::move(body));
  }

  void add_link(const btVector3& extents, const btVector3& at) {
    what_ += ", on a multibody";
    btTransform pose = pose_;
    pose.setOrigin(pose_ * at);
    multibody_ = std::make_unique<btMultiBody>(0, 0, btVector3(0, 0, 0), true, false);
    multibody_->setBaseWorldTransform(pose);
    multibody_->finalizeMultiDof();
    dynamic_cast<btMultiBodyDynamicsWorld&>(world_.bullets()).addMultiBody(multibody_.get());
    shapes_.push_back(std::make_unique<btBoxShape>(extents));
    collider_ = std::make_unique<btMultiBodyLinkCollider>(multibody_.get(), -1);
    collider_->setCollisionShape(shapes_.back().get());
    collider_->setWorldTransform(pose);
    collider_->setCollisionFlags(collider_->getCollisionFlags() |
                                 btCollisionObject::CF_STATIC_OBJECT);
    multibody_->setBaseCollider(collider_.get());
    world_.bullets().addCollisionObject(collider_.get(), 1 << 8, -1);
    add_surface(*collider_, *shapes_.back(), true);
  }

  void add_surface(const btCollisionObject& body, btCollisionShape& shape, bool stays) {
    // The corners of a plane's triangles are so far away that they are rounded by metres:
    // count_fallen() is enough.
    if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) return;
    // LazyCCD's hulls have no margin.
    const btScalar margin = shape.getMargin();
    if (shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE) shape.setMargin(0);
    scenes::Triangles triangles = scenes::tessellate(shape);
    shape.setMargin(margin);
    if (triangles.faces.empty()) return;
    surfaces_.push_back(std::make_unique<scenes::Triangles>(std::move(triangles)));
    obstacles_.push_back({&body, surfaces_.back().get(), stays});
  }

  // Nodes of the body that are below the surface that it started on; near its border they may have
  // slid off. Below a cloth: deeper than its lowest node.
  int count_fallen() const {
    const btSoftBody& body = *soft_.back();
    double deep = 0.02 * size_ + 8 * std::abs(offset_);
    btTransform frame = pose_;
    if (!rigid_.empty() && !rigid_[0]->isStaticOrKinematicObject()) frame = moved_frame(*rigid_[0]);
    if (soft_.size() > 1) {
      for (int i = 0; i < soft_[0]->m_nodes.size(); ++i)
        deep = std::max(
            deep, 0.02 * size_ - static_cast<double>(frame.invXform(soft_[0]->m_nodes[i].m_x).y()));
    }
    const double limit = 0.7 * top_half_;
    int fallen = 0;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      const btVector3 x = frame.invXform(body.m_nodes[i].m_x);
      const bool is_over_border = std::abs(static_cast<double>(x.x())) > limit ||
                                  std::abs(static_cast<double>(x.z())) > limit;
      fallen += !is_over_border && static_cast<double>(x.y()) < -deep;
    }
    return fallen;
  }

  btTransform moved_frame(const btRigidBody& body) const {
    const btScalar depth =
        static_cast<const btBoxShape&>(*body.getCollisionShape()).getHalfExtentsWithMargin().y();
    btTransform frame = body.getWorldTransform();
    frame.setOrigin(frame * btVector3(0, depth, 0));
    return frame;
  }

  double weight() const {
    double mass = 0;
    for (const auto& body : soft_) mass += mass_of(*body);
    return mass * gravity;
  }
  static double mass_of(const btSoftBody& body) {
    double mass = 0;
    for (int i = 0; i < body.m_nodes.size(); ++i)
      if (body.m_nodes[i].m_im > 0) mass += 1 / static_cast<double>(body.m_nodes[i].m_im);
    return mass;
  }

  // Of motion and place, J, relative to the surface.
  double energy() const {
    double sum = 0;
    for (const auto& body : soft_) {
      for (int i = 0; i < body->m_nodes.size(); ++i) {
        const btSoftBody::Node& node = body->m_nodes[i];
        if (!(node.m_im > 0)) continue;
        const double height = static_cast<double>(pose_.invXform(node.m_x).y());
        sum += (static_cast<double>(node.m_v.length2()) / 2 + gravity * height) /
               static_cast<double>(node.m_im);
      }
    }
    return sum;
  }

  RandomSource random_;
  RandomSource fixed_{0};  // of the world's own parts
  World kind_;
  RandomWorld world_;
  double size_ = 1, margin_ = 0, offset_ = 0, top_half_ = 1;  // metres
  btTransform pose_;
  std::string what_;
  std::vector<std::unique_ptr<btSoftBody>> soft_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_, parts_;
  std::unique_ptr<btTriangleMesh> mesh_;
  std::vector<btScalar> heights_;
  std::vector<std::unique_ptr<btRigidBody>> rigid_;
  std::unique_ptr<btMultiBody> multibody_;
  std::unique_ptr<btMultiBodyLinkCollider> collider_;
  std::vector<std::unique_ptr<scenes::Triangles>> surfaces_;
  std::vector<PenetrationCheck::Obstacle> obstacles_;
};

}  // namespace

StartReport run_touching_start(std::uint32_t number, World world, Collisions collisions) {
  return Start(number, world, collisions).run();
}

std::string faults_of(const StartReport& start, const StartReport& alone) {
  std::string faults;
  if (!start.is_finite && alone.is_finite) faults += " NOT FINITE";
  if (!start.is_finite) return faults;
  if (start.fallen > 0) faults += " FELL";
  if (start.piercing > 0 && (start.piercing > alone.piercing || !alone.is_finite))
    faults += " STICKS";
  if (!alone.is_finite) return faults;
  if (start.fastest > 1.3 * alone.fastest + 0.3) faults += " FAST";
  if (start.gained > alone.gained + 0.01 * start.scale + start.lift) faults += " ENERGY";
  return faults;
}

}  // namespace lazyccd::test
