#include "world.h"

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <LinearMath/btMotionState.h>
#include <lazyccd/bullet/deformable_world.h>
#include <lazyccd/bullet/soft_body_solver.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace lazyccd::javascript {
namespace {

btVector3 vector(const float* x) { return btVector3(x[0], x[1], x[2]); }

// The place that a kinematic body goes to.
class Path : public btMotionState {
 public:
  explicit Path(const btTransform& pose) : pose_(pose) {}
  void go(const btTransform& pose) { pose_ = pose; }
  void getWorldTransform(btTransform& pose) const override { pose = pose_; }
  void setWorldTransform(const btTransform& pose) override { pose_ = pose; }

 private:
  btTransform pose_;
};

// Calls visit(a, b) once for each edge of faces and tetrahedra, in order.
template <class Visit>
void for_each_edge(const SoftBodyDescription& description, const Visit& visit) {
  std::set<std::pair<std::int32_t, std::int32_t>> seen;
  const auto add_corners = [&](const std::vector<std::int32_t>& corners, std::size_t count) {
    for (std::size_t first = 0; first < corners.size(); first += count)
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = i + 1; k < count; ++k) {
          const auto edge = std::minmax(corners[first + i], corners[first + k]);
          if (seen.insert(edge).second) visit(edge.first, edge.second);
        }
  };
  add_corners(description.faces, 3);
  add_corners(description.tetrahedra, 4);
}

}  // namespace

// The solvers and the world of one kind, with the collisions of one kind.
struct World::Solver {
  std::unique_ptr<btSoftBodySolver> soft;
  std::unique_ptr<btSequentialImpulseConstraintSolver> constraints;
  std::unique_ptr<btDiscreteDynamicsWorld> world;
  // The same objects by their own types, null for the others.
  bullet::btLazySoftBodySolver* lazy_rigid = nullptr;
  bullet::btLazyDeformableBodySolver* lazy_deformable = nullptr;
  btSoftRigidDynamicsWorld* rigid = nullptr;
  btDeformableMultiBodyDynamicsWorld* deformable = nullptr;

  btSoftBodyWorldInfo& info() const {
    return rigid ? rigid->getWorldInfo() : deformable->getWorldInfo();
  }
  void teleported(const btCollisionObject& body) const {
    if (lazy_rigid) lazy_rigid->teleported(body);
    if (lazy_deformable) lazy_deformable->teleported(body);
  }
  Span<const bullet::StepContact> contacts() const {
    if (lazy_rigid) return lazy_rigid->contacts();
    return lazy_deformable ? lazy_deformable->contacts() : Span<const bullet::StepContact>();
  }
};

struct World::Body {
  std::unique_ptr<btSoftBody> soft;
  std::vector<btScalar> inverse_masses;          // of all nodes, as if none were pinned
  std::vector<std::pair<int, btVector3>> goals;  // pinned nodes, and where they go in the next step
  std::vector<std::unique_ptr<btDeformableLagrangianForce>> forces;

  std::shared_ptr<void> parts;  // what the shape refers to
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<Path> path;
  std::unique_ptr<btRigidBody> rigid;

  std::vector<float> positions, velocities, pose;  // what was read last
};

void ContactArrays::clear() {
  for (std::vector<std::int32_t>* const list : {&bodies, &nodes, &kinds}) list->clear();
  for (std::vector<float>* const list : {&points, &normals, &impulses, &times}) list->clear();
}

World::World(Kind kind, Collisions collisions, const btVector3& gravity,
             const bullet::SolverOptions& options)
    : kind_(kind), dispatcher_(&configuration_), solver_(std::make_unique<Solver>()) {
  Solver& s = *solver_;
  const bool is_lazy = collisions == Collisions::lazyccd;
  if (kind == Kind::rigid) {
    if (is_lazy) {
      auto lazy = std::make_unique<bullet::btLazySoftBodySolver>(options);
      s.lazy_rigid = lazy.get();
      s.soft = std::move(lazy);
    } else {
      s.soft = std::make_unique<btDefaultSoftBodySolver>();
    }
    s.constraints = std::make_unique<btSequentialImpulseConstraintSolver>();
    auto world = std::make_unique<btSoftRigidDynamicsWorld>(
        &dispatcher_, &broadphase_, s.constraints.get(), &configuration_, s.soft.get());
    s.rigid = world.get();
    s.world = std::move(world);
  } else {
    auto constraints = std::make_unique<btDeformableMultiBodyConstraintSolver>();
    std::unique_ptr<btDeformableMultiBodyDynamicsWorld> world;
    if (is_lazy) {
      auto lazy = std::make_unique<bullet::btLazyDeformableBodySolver>(options);
      constraints->setDeformableSolver(lazy.get());
      s.lazy_deformable = lazy.get();
      world = std::make_unique<bullet::btLazyDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, constraints.get(), &configuration_, lazy.get());
      s.soft = std::move(lazy);
    } else {
      auto solver = std::make_unique<btDeformableBodySolver>();
      constraints->setDeformableSolver(solver.get());
      world = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, constraints.get(), &configuration_, solver.get());
      s.soft = std::move(solver);
    }
    s.deformable = world.get();
    s.constraints = std::move(constraints);
    s.world = std::move(world);
  }
  s.world->setGravity(gravity);
  s.info().m_gravity = gravity;
  s.info().air_density = 0;
}

World::~World() {
  for (int i = 0; i < static_cast<int>(bodies_.size()); ++i)
    if (bodies_[i]) remove(i);
}

int World::add(const SoftBodyDescription& description) {
  using Flag = btSoftBody::fCollision;
  const int count = static_cast<int>(description.positions.size() / 3);
  std::vector<btVector3> positions;
  for (int i = 0; i < count; ++i) positions.push_back(vector(&description.positions[3 * i]));
  const std::vector<btScalar> masses(count, btScalar(1) / static_cast<btScalar>(count));
  auto body = std::make_unique<Body>();
  body->soft =
      std::make_unique<btSoftBody>(&solver_->info(), count, positions.data(), masses.data());
  btSoftBody& soft = *body->soft;
  soft.appendMaterial();
  if (!description.links.empty()) {
    for (std::size_t i = 0; i < description.links.size(); i += 2)
      soft.appendLink(description.links[i], description.links[i + 1]);
  } else {
    for_each_edge(description, [&](int a, int b) { soft.appendLink(a, b); });
  }
  for (std::size_t i = 0; i < description.faces.size(); i += 3) {
    const std::int32_t* const f = &description.faces[i];
    soft.appendFace(f[0], f[1], f[2]);
  }
  for (std::size_t i = 0; i < description.tetrahedra.size(); i += 4) {
    const std::int32_t* const t = &description.tetrahedra[i];
    soft.appendTetra(t[0], t[1], t[2], t[3]);
  }
  if (kind_ == Kind::rigid) {
    soft.m_cfg.collisions = Flag::SDF_RS | Flag::VF_SS;
  } else {
    soft.m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDN | Flag::SDF_RDF | Flag::VF_DD;
    soft.m_cfg.kKHR = soft.m_cfg.kCHR = 1;
    if (!description.tetrahedra.empty()) {
      soft.initializeDmInverse();
      soft.m_tetraScratches.resize(soft.m_tetras.size());
      soft.m_tetraScratchesTn.resize(soft.m_tetras.size());
    }
  }
  body->inverse_masses.assign(count, static_cast<btScalar>(count));
  const int number = static_cast<int>(bodies_.size());
  soft.setUserIndex(number);
  if (solver_->rigid) {
    solver_->rigid->addSoftBody(&soft);
  } else {
    solver_->deformable->addSoftBody(&soft);
    body->forces.push_back(
        std::make_unique<btDeformableGravityForce>(solver_->world->getGravity()));
    solver_->deformable->addForce(&soft, body->forces.back().get());
  }
  bodies_.push_back(std::move(body));
  for (const std::int32_t node : description.pinned) pin(number, node, true);
  return number;
}

void World::add_springs(int body, double stiffness, double damping) {
  Body& b = soft(body);
  b.forces.push_back(std::make_unique<btDeformableMassSpringForce>(static_cast<btScalar>(stiffness),
                                                                   static_cast<btScalar>(damping)));
  solver_->deformable->addForce(b.soft.get(), b.forces.back().get());
}

void World::add_elasticity(int body, double mu, double lambda, double damping) {
  Body& b = soft(body);
  const auto c = static_cast<btScalar>(damping);
  b.forces.push_back(std::make_unique<btDeformableLinearElasticityForce>(
      static_cast<btScalar>(mu), static_cast<btScalar>(lambda), c, c));
  solver_->deformable->addForce(b.soft.get(), b.forces.back().get());
}

void World::add_bending(int body, int distance) {
  soft(body).soft->generateBendingConstraints(distance);
}

void World::set(int body, SoftBodyNumber number, double value) {
  Body& b = soft(body);
  btSoftBody& s = *b.soft;
  const auto x = static_cast<btScalar>(value);
  switch (number) {
    case SoftBodyNumber::mass: {
      const auto each = static_cast<btScalar>(value / s.m_nodes.size());
      for (int i = 0; i < s.m_nodes.size(); ++i) {
        b.inverse_masses[i] = 1 / each;
        if (s.m_nodes[i].m_im > 0) s.setMass(i, each);
      }
      return;
    }
    case SoftBodyNumber::margin:
      s.getCollisionShape()->setMargin(x);
      return s.updateBounds();
    case SoftBodyNumber::stiffness:
      s.m_materials[0]->m_kLST = x;
      return s.updateLinkConstants();
    case SoftBodyNumber::friction:
      s.m_cfg.kDF = x;
      return s.setFriction(x);
    case SoftBodyNumber::damping:
      s.m_cfg.kDP = x;
      return;
    case SoftBodyNumber::pressure:
      s.m_cfg.kPR = x;
      return;
    case SoftBodyNumber::iterations:
      s.m_cfg.piterations = static_cast<int>(value);
      return;
    case SoftBodyNumber::self_collision:
      return s.setSelfCollision(value != 0);
  }
}

void World::pin(int body, int node, bool is_pinned) {
  Body& b = soft(body);
  b.soft->setMass(node, is_pinned ? 0 : 1 / b.inverse_masses[node]);
  b.soft->activate();
}

void World::steer(int body, int node, const btVector3& goal) {
  Body& b = soft(body);
  b.goals.emplace_back(node, goal);
  b.soft->activate();
}

void World::push(int body, int node, const btVector3& force) {
  btSoftBody& s = *soft(body).soft;
  if (node < 0)
    s.addForce(force);
  else
    s.addForce(force, node);
  s.activate();
}

void World::place(int body, const float* positions, const float* velocities) {
  btSoftBody& s = *soft(body).soft;
  for (int i = 0; i < s.m_nodes.size(); ++i) {
    btSoftBody::Node& node = s.m_nodes[i];
    node.m_x = node.m_q = vector(positions + 3 * i);
    if (velocities) node.m_v = node.m_vn = vector(velocities + 3 * i);
  }
  s.updateNormals();
  s.updateBounds();
  s.activate();
  solver_->teleported(s);
}

int World::add(std::unique_ptr<btCollisionShape> shape, std::shared_ptr<void> parts, double mass,
               bool is_kinematic, const btTransform& pose, double friction) {
  auto body = std::make_unique<Body>();
  body->parts = std::move(parts);
  body->shape = std::move(shape);
  btVector3 inertia(0, 0, 0);
  if (mass > 0) body->shape->calculateLocalInertia(static_cast<btScalar>(mass), inertia);
  body->path = std::make_unique<Path>(pose);
  body->rigid = std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(
      static_cast<btScalar>(mass), body->path.get(), body->shape.get(), inertia));
  btRigidBody& rigid = *body->rigid;
  rigid.setFriction(static_cast<btScalar>(friction));
  if (is_kinematic) {
    rigid.setCollisionFlags(rigid.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    rigid.setActivationState(DISABLE_DEACTIVATION);
  }
  const int number = static_cast<int>(bodies_.size());
  rigid.setUserIndex(number);
  solver_->world->addRigidBody(&rigid);
  bodies_.push_back(std::move(body));
  return number;
}

void World::move(int body, const btTransform& pose) { bodies_[body]->path->go(pose); }

void World::teleport(int body, const btTransform& pose) {
  Body& b = *bodies_[body];
  b.path->go(pose);
  b.rigid->setCenterOfMassTransform(pose);
  b.rigid->setInterpolationWorldTransform(pose);
  b.rigid->activate();
  solver_->world->updateSingleAabb(b.rigid.get());
  solver_->teleported(*b.rigid);
}

void World::remove(int body) {
  Body& b = *bodies_[body];
  if (b.rigid) {
    solver_->world->removeRigidBody(b.rigid.get());
  } else if (solver_->rigid) {
    solver_->rigid->removeSoftBody(b.soft.get());
  } else {
    for (const auto& force : b.forces) solver_->deformable->removeForce(b.soft.get(), force.get());
    solver_->deformable->removeSoftBody(b.soft.get());
  }
  bodies_[body].reset();
  contacts_.clear();
}

void World::step(double seconds) {
  steer_nodes(seconds);
  const auto dt = static_cast<btScalar>(seconds);
  solver_->world->stepSimulation(dt, 0, dt);
  solver_->info().m_sparsesdf.GarbageCollect();
  for (const auto& body : bodies_) {
    if (!body) continue;
    for (const auto& goal : body->goals) {  // a goal is reached in one step
      btSoftBody::Node& node = body->soft->m_nodes[goal.first];
      node.m_v.setZero();
      node.m_vn.setZero();
    }
    body->goals.clear();
  }
}

void World::steer_nodes(double seconds) {
  for (const auto& body : bodies_) {
    if (!body) continue;
    for (const auto& goal : body->goals) {
      btSoftBody::Node& node = body->soft->m_nodes[goal.first];
      if (node.m_im == 0) node.m_v = (goal.second - node.m_x) / static_cast<btScalar>(seconds);
    }
  }
}

bool World::has(int body) const {
  return body >= 0 && body < static_cast<int>(bodies_.size()) && bodies_[body] != nullptr;
}

int World::node_count(int body) const {
  const Body& b = *bodies_[body];
  return b.soft ? b.soft->m_nodes.size() : 0;
}

World::Body& World::soft(int body) { return *bodies_[body]; }

const std::vector<float>& World::positions(int body) {
  Body& b = soft(body);
  b.positions.clear();
  for (int i = 0; i < b.soft->m_nodes.size(); ++i)
    for (int k = 0; k < 3; ++k)
      b.positions.push_back(static_cast<float>(b.soft->m_nodes[i].m_x[k]));
  return b.positions;
}

const std::vector<float>& World::velocities(int body) {
  Body& b = soft(body);
  b.velocities.clear();
  for (int i = 0; i < b.soft->m_nodes.size(); ++i)
    for (int k = 0; k < 3; ++k)
      b.velocities.push_back(static_cast<float>(b.soft->m_nodes[i].m_v[k]));
  return b.velocities;
}

const std::vector<float>& World::pose(int body) {
  Body& b = *bodies_[body];
  const btTransform& pose = b.rigid->getWorldTransform();
  const btQuaternion q = pose.getRotation();
  b.pose.clear();
  for (int k = 0; k < 3; ++k) b.pose.push_back(static_cast<float>(pose.getOrigin()[k]));
  for (int k = 0; k < 4; ++k) b.pose.push_back(static_cast<float>(q[k]));
  return b.pose;
}

const ContactArrays& World::contacts() {
  ContactArrays& c = contacts_;
  c.clear();
  for (const bullet::StepContact& contact : solver_->contacts()) {
    const btCollisionObject* const objects[] = {contact.body_a, contact.body_b};
    const int first_of_b = first_vertex_of_b(contact.kind);
    for (const btCollisionObject* object : objects) c.bodies.push_back(object->getUserIndex());
    for (int i = 0; i < 4; ++i) {
      const btSoftBody* const body = btSoftBody::upcast(objects[i >= first_of_b]);
      const btSoftBody::Node* const node = contact.nodes[i];
      c.nodes.push_back(body && node ? static_cast<std::int32_t>(node - &body->m_nodes[0]) : -1);
    }
    c.kinds.push_back(static_cast<std::int32_t>(contact.kind));
    for (int k = 0; k < 3; ++k) {
      c.points.push_back(static_cast<float>(contact.point[k]));
      c.normals.push_back(static_cast<float>(contact.normal[k]));
    }
    c.impulses.push_back(static_cast<float>(contact.impulse));
    c.times.push_back(static_cast<float>(contact.toi));
  }
  return c;
}

const bullet::StepStats* World::stats() const {
  if (solver_->lazy_rigid) return &solver_->lazy_rigid->step_stats();
  return solver_->lazy_deformable ? &solver_->lazy_deformable->step_stats() : nullptr;
}

std::string World::status() const {
  if (solver_->lazy_rigid) return solver_->lazy_rigid->status();
  return solver_->lazy_deformable ? solver_->lazy_deformable->status() : "Bullet alone";
}

}  // namespace lazyccd::javascript
