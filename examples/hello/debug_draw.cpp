// Draws one step of a scene through Bullet's debug drawer, and writes the lines as an SVG picture.
// Bullet draws the bodies, in grey; LazyCCD draws what its step did.
//
//   example_debug_draw picture.svg
//
// Three scenes stand side by side. A cloth lies on a ball. A box lies on a cloth, and both on a
// table. Two plates close in on a cloth until there is no room left: impact zones, then holds.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <LinearMath/btIDebugDraw.h>
#include <lazyccd/bullet/soft_body_solver.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

namespace {

btScalar real(double x) { return static_cast<btScalar>(x); }
btVector3 vec(double x, double y, double z) { return btVector3(real(x), real(y), real(z)); }

/// Keeps lines, and writes them as a camera sees them, in the order in which they were drawn.
class SvgDrawer : public btIDebugDraw {
 public:
  void drawLine(const btVector3& from, const btVector3& to, const btVector3& colour) override {
    lines_.push_back({from, to, colour});
  }
  bool write(const char* path) const {
    std::FILE* const file = std::fopen(path, "w");
    if (!file) return false;
    std::fprintf(file,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\">\n"
                 "<rect width=\"%d\" height=\"%d\" fill=\"#1b1d21\"/>\n"
                 "<g fill=\"none\" stroke-width=\"1\" stroke-linecap=\"round\">\n",
                 width, height, width, height);
    for (std::size_t first = 0, last; first < lines_.size(); first = last) {
      const btVector3& colour = lines_[first].colour;
      const auto channel = [&colour](int k) { return std::lround(255 * double(colour[k])); };
      std::fprintf(file, "<path stroke=\"#%02lx%02lx%02lx\" d=\"", channel(0), channel(1),
                   channel(2));
      for (last = first; last < lines_.size() && lines_[last].colour == colour; ++last) {
        const btVector3 a = on_picture(lines_[last].from), b = on_picture(lines_[last].to);
        std::fprintf(file, "M%.1f %.1fL%.1f %.1f", double(a.x()), double(a.y()), double(b.x()),
                     double(b.y()));
      }
      std::fprintf(file, "\"/>\n");
    }
    std::fprintf(file, "</g>\n</svg>\n");
    return std::fclose(file) == 0;
  }

  // Bullet calls these too; the picture has nothing for them.
  void drawContactPoint(const btVector3&, const btVector3&, btScalar, int,
                        const btVector3&) override {}
  void reportErrorWarning(const char*) override {}
  void draw3dText(const btVector3&, const char*) override {}
  void setDebugMode(int) override {}
  int getDebugMode() const override { return DBG_DrawWireframe; }

 private:
  struct Line {
    btVector3 from, to, colour;
  };

  static constexpr int width = 1200, height = 400;  // pixels

  static btVector3 on_picture(const btVector3& point) {
    const btVector3 eye = vec(0.3, 1.9, 5), target = vec(0, 0.03, 0);
    const btVector3 forward = (target - eye).normalized();
    const btVector3 right = forward.cross(btVector3(0, 1, 0)).normalized();
    const btVector3 up = right.cross(forward);
    const btVector3 away = point - eye;
    const btScalar scale = 1750 / away.dot(forward);
    return btVector3(width / real(2) + scale * away.dot(right),
                     height / real(2) - scale * away.dot(up), 0);
  }

  std::vector<Line> lines_;
};

/// The world, and all that is in it.
class Scene {
 public:
  Scene() {
    world_.setGravity(vec(0, -10, 0));
    world_.getWorldInfo().m_gravity = world_.getGravity();
    world_.setDebugDrawer(&drawer);
  }
  ~Scene() {
    for (const auto& body : soft_) world_.removeSoftBody(body.get());
    for (const auto& body : rigid_) world_.removeRigidBody(body.get());
  }

  /// A square cloth of 0.8 m by 0.8 m, level, around `centre`.
  void add_cloth(const btVector3& centre, int nodes) {
    const btScalar half = real(0.4);
    std::unique_ptr<btSoftBody> cloth(btSoftBodyHelpers::CreatePatch(
        world_.getWorldInfo(), centre + btVector3(-half, 0, -half),
        centre + btVector3(half, 0, -half), centre + btVector3(-half, 0, half),
        centre + btVector3(half, 0, half), nodes, nodes, 0, false));
    cloth->m_cfg.collisions |= btSoftBody::fCollision::VF_SS;
    cloth->m_cfg.piterations = 10;
    cloth->setTotalMass(real(0.3));
    cloth->getCollisionShape()->setMargin(real(0.01));
    world_.addSoftBody(cloth.get());
    soft_.push_back(std::move(cloth));
  }
  btRigidBody& add(std::unique_ptr<btCollisionShape> shape, const btVector3& at, double mass = 0) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(real(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(real(mass), nullptr, shape.get(), inertia);
    info.m_startWorldTransform = btTransform(btQuaternion::getIdentity(), at);
    rigid_.push_back(std::make_unique<btRigidBody>(info));
    shapes_.push_back(std::move(shape));
    world_.addRigidBody(rigid_.back().get());
    return *rigid_.back();
  }
  void step() { world_.stepSimulation(real(1.0 / 60), 0); }

  void draw() {
    const btVector3 grey = vec(0.42, 0.44, 0.47);
    for (const auto& body : rigid_)
      world_.debugDrawObject(body->getWorldTransform(), body->getCollisionShape(), grey);
    for (const auto& body : soft_)
      for (int i = 0; i < body->m_links.size(); ++i)
        drawer.drawLine(body->m_links[i].m_n[0]->m_x, body->m_links[i].m_n[1]->m_x, grey);
    solver.debug_draw(drawer);  // contacts, impulses, islands, zones, holds
  }

  lazyccd::bullet::btLazySoftBodySolver solver;
  SvgDrawer drawer;

 private:
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver constraints_;
  btSoftRigidDynamicsWorld world_{&dispatcher_, &broadphase_, &constraints_, &configuration_,
                                  &solver};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btSoftBody>> soft_;
  std::vector<std::unique_ptr<btRigidBody>> rigid_;
};

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: example_debug_draw PICTURE.svg\n");
    return 2;
  }
  Scene scene;
  scene.add(std::make_unique<btSphereShape>(real(0.3)), vec(-1.2, 0, 0));
  scene.add_cloth(vec(-1.2, 0.34, 0), 13);

  scene.add(std::make_unique<btBoxShape>(vec(0.45, 0.2, 0.45)), vec(0, -0.1, 0));
  scene.add_cloth(vec(0, 0.13, 0), 9);
  scene.add(std::make_unique<btBoxShape>(vec(0.12, 0.12, 0.12)), vec(0.05, 0.3, 0), 0.5);

  scene.add(std::make_unique<btBoxShape>(vec(0.45, 0.05, 0.45)), vec(1.2, 0, 0));
  scene.add_cloth(vec(1.2, 0.1, 0), 9);
  btRigidBody& plate =
      scene.add(std::make_unique<btBoxShape>(vec(0.25, 0.05, 0.25)), vec(1.2, 0.6, 0));
  plate.setCollisionFlags(plate.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  plate.setActivationState(DISABLE_DEACTIVATION);

  for (int step = 0; step < 200 && scene.solver.step_stats().failsafe_holds == 0; ++step) {
    btTransform pose = plate.getWorldTransform();
    pose.getOrigin() -= vec(0, 0.01, 0);
    plate.setWorldTransform(pose);
    scene.step();
  }
  scene.draw();
  if (!scene.drawer.write(arguments[1])) {
    std::fprintf(stderr, "cannot write %s\n", arguments[1]);
    return 1;
  }
  std::printf("contacts: %zu, islands: %d, nodes in impact zones: %d, held: %d\n",
              scene.solver.contacts().size(), int(scene.solver.step_stats().islands),
              int(scene.solver.step_stats().impact_zone_nodes),
              int(scene.solver.step_stats().failsafe_holds));
  return 0;
}
