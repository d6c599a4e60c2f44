// Untangling: soft bodies that intersect at the start of a scene are moved apart.
#include "untangling/untangling.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <cmath>
#include <string>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "scenes/measures/intersections.h"
#include "scenes/meshes/surface.h"
#include "scenes/scene.h"
#include "support/catch.h"
#include "util/matrix.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

std::size_t intersections(const PhysicsWorld& world) {
  return scenes::find_intersections(scenes::read_surface(world), scenes::read_positions(world))
      .size();
}

btVector3 at(double x, double y, double z) {
  return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z));
}

void add_cloth(PhysicsWorld& world, const std::function<btVector3(double x, double z)>& place) {
  world.add(scenes::make_cloth(world.info(), 9, 9, 1,
                               [&](double u, double v) { return place(u - 0.5, v - 0.5); }));
}

void add_ball(PhysicsWorld& world, const btVector3& centre) {
  const btVector3 radius = at(0.2, 0.2, 0.2);
  std::unique_ptr<btSoftBody> ball(
      btSoftBodyHelpers::CreateEllipsoid(world.info(), centre, radius, 80));
  ball->setTotalMass(1);
  world.add(std::move(ball));
}

void add_crossed(PhysicsWorld& world, const std::string& how) {
  if (how == "balls") {
    add_ball(world, at(0, 0, 0));
    add_ball(world, at(0.1, 0.25, 0.05));
    return;
  }
  add_cloth(world, [](double x, double z) { return at(x, 0, z); });
  add_cloth(world, [&](double x, double z) {
    const double u = 0.8 * x + 0.013, v = 0.8 * z + 0.017;
    if (how == "border") return at(u, 0.04 - 0.22 * z, v);
    if (how == "upright") return at(0.5 * u, 0.5 * v - 0.06, 0.05 * u + 0.017);
    const double r = std::hypot(u, v);  // a bulge
    return at(u, 0.05 - (r < 0.2 ? 0.03 + 0.1 * (1 - r / 0.2) : 0), v);
  });
}

// Triangles of a box whose upper side is in the plane y = 0.
std::unique_ptr<btTriangleMesh> box_triangles(bool inverted) {
  auto mesh = std::make_unique<btTriangleMesh>();
  const auto corner = [](int i) {
    return at(i & 1 ? 0.5 : -0.5, i & 2 ? 0 : -0.3, i & 4 ? 0.5 : -0.5);
  };
  const int sides[6][4] = {{0, 1, 3, 2}, {5, 4, 6, 7}, {4, 0, 2, 6},
                           {1, 5, 7, 3}, {2, 3, 7, 6}, {4, 5, 1, 0}};
  for (const auto& side : sides) {
    for (const int first : {0, 2}) {
      const int a = side[first], b = side[first + 1], c = side[(first + 2) % 4];
      mesh->addTriangle(corner(a), corner(inverted ? c : b), corner(inverted ? b : c));
    }
  }
  return mesh;
}

scenes::WorldOptions untangling(World world, double speed) {
  scenes::WorldOptions options = quiet_options(world);
  options.lazyccd.untangling_speed = speed;
  return options;
}

}  // namespace

TEST_CASE("soft bodies that start intersecting are moved apart and stay apart") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string how = GENERATE("bulge", "border", "upright", "balls");
  CAPTURE(world == World::rigid, how);
  const auto w = PhysicsWorld::make(untangling(world, 1));
  add_crossed(*w, how);
  REQUIRE(intersections(*w) > 0);
  for (int i = 0; i < 180; ++i) w->step();
  CHECK(intersections(*w) == 0);
  CHECK(w->total_stats()->energy_gained < 1e-9);
  CHECK(w->total_stats()->failsafe_holds == 0);
}

TEST_CASE("soft bodies that start inside a static body are moved out of it") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string what = GENERATE("border", "upright", "ball");
  // "mesh" is open. A box is a closed mesh; an inverted one has no inside, as if it were open.
  const std::string in = GENERATE("mesh", "box", "inverted box");
  CAPTURE(world == World::rigid, what, in);
  const auto w = PhysicsWorld::make(untangling(world, 1));
  const auto triangles = in == "mesh" ? flat_triangles(8, 2) : box_triangles(in == "inverted box");
  w->add_static(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true),
                btTransform::getIdentity());
  if (what == "ball") add_ball(*w, at(0.03, 0.1, 0.05));
  if (what == "border")
    add_cloth(*w, [](double x, double z) { return at(0.8 * x, 0.04 - 0.22 * z, 0.8 * z); });
  if (what == "upright")
    add_cloth(*w, [](double x, double z) { return at(0.5 * x, 0.5 * z + 0.06, 0.05 * x + 0.017); });
  REQUIRE(intersections(*w) > 0);
  for (int i = 0; i < 180; ++i) w->step();
  CHECK(intersections(*w) == 0);
  for (int i = 0; i < w->bodies()[0]->m_nodes.size(); ++i)
    CHECK(w->bodies()[0]->m_nodes[i].m_x.y() > 0);
  CHECK(w->total_stats()->energy_gained < 1e-9);
  CHECK(w->total_stats()->failsafe_holds == 0);
}

TEST_CASE("cloth that starts inside a rigid ball is moved out of it") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double mass = GENERATE(0.0, 1.0);
  const double height = GENERATE(-0.15, 0.1);
  CAPTURE(world == World::rigid, mass, height);
  const auto w = PhysicsWorld::make(untangling(world, 1));
  const btTransform pose(btQuaternion::getIdentity(), at(0.02, height, 0.03));
  const btVector3 centre(0, 0, 0);
  const btScalar radius = btScalar(0.2);
  auto shape = std::make_unique<btMultiSphereShape>(&centre, &radius, 1);
  if (mass > 0) {
    w->add_dynamic(std::move(shape), pose, mass);
  } else {
    w->add_static(std::move(shape), pose);
  }
  add_cloth(*w, [](double x, double z) { return at(x, 0, z); });
  for (int i = 0; i < 300; ++i) w->step();
  REQUIRE(w->total_stats()->initial_intersections > 0);
  const btRigidBody& ball = *w->rigid_bodies()[0].body;
  const btSoftBody& cloth = *w->bodies()[0];
  for (int i = 0; i < cloth.m_nodes.size(); ++i)
    CHECK(cloth.m_nodes[i].m_x.distance(ball.getCenterOfMassPosition()) > btScalar(0.196));
  CHECK(w->total_stats()->energy_gained < 1e-9);
}

TEST_CASE("a soft body that starts deep in the ground is not thrown up, at any time step") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double rate = GENERATE(60.0, 240.0);
  CAPTURE(world == World::rigid, rate);
  scenes::WorldOptions options = quiet_options(world, 1 / rate);
  options.gravity = 10;
  const auto w = PhysicsWorld::make(options);
  const btScalar half = 5;
  w->add_static(std::make_unique<btBoxShape>(btVector3(half, half, half)),
                btTransform(btQuaternion::getIdentity(), btVector3(0, -half, 0)));
  constexpr double radius = 0.5;
  std::unique_ptr<btSoftBody> ball(
      btSoftBodyHelpers::CreateEllipsoid(w->info(), at(0, 0, 0), at(radius, radius, radius), 200));
  ball->setTotalMass(1);
  ball->m_materials[0]->m_kLST = 1;
  w->add(std::move(ball));
  double lowest = 0, highest = 0;
  for (int i = 0; i < 3 * rate; ++i) {
    w->step();
    btVector3 aabb_min, aabb_max;
    w->bodies()[0]->getAabb(aabb_min, aabb_max);
    lowest = static_cast<double>(aabb_min.y());
    highest = std::max(highest, static_cast<double>(aabb_max.y()));
  }
  CHECK(lowest > -0.1);  // the box of the body has a margin
  CHECK(highest < 3 * radius);
}

TEST_CASE("a clean start gives bit-identical results with untangling") {
  const World world = GENERATE(World::rigid, World::deformable);
  const auto positions = [&](double speed) {
    scenes::Parameters parameters;
    parameters.world = world;
    parameters.size = 0.5;
    parameters.lazyccd.untangling_speed = speed;
    scenes::Scene scene = scenes::set_up(*scenes::find_scene("free-cloths"), parameters);
    for (int i = 0; i < 20; ++i) scene.world->step();
    CHECK(scene.world->total_stats()->contacts_vf > 0);
    return scenes::read_positions(*scene.world);
  };
  CHECK(positions(0) == positions(1));
}

TEST_CASE("cloth anchored inside a rigid body stays there") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  bullet::SolverOptions options;
  options.untangling_speed = 1;
  ObstacleWorld w(world, 0, options);
  btRigidBody* box =
      w.add(std::make_unique<btBoxShape>(btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1))),
            btVector3(0, 0, 0), 1);
  btSoftBody* cloth = w.add(scenes::make_cloth(
      w.info(), 5, 5, 1, [](double u, double v) { return at(u, 0.01, 0.02 + v); }));
  if (w.is_rigid()) {
    cloth->appendAnchor(0, box);
  } else {
    cloth->appendDeformableAnchor(0, box);
  }
  w.steps(30);
  CHECK(w.total().initial_intersections == 0);
  CHECK(cloth->m_nodes[0].m_x.distance(at(0, 0.01, 0.02)) < btScalar(1e-3));
}

namespace {

// Two bodies of triangles at rest, and their intersections.
class Tangle {
 public:
  Tangle(const std::vector<btVector3>& points, std::vector<double> inverse_masses,
         std::vector<std::int32_t> body_of_vertex, std::vector<Face> faces, std::vector<Edge> edges,
         std::vector<bullet::Intersection> pairs, double dt)
      : body_of_vertex_(std::move(body_of_vertex)),
        faces_(std::move(faces)),
        edges_(std::move(edges)) {
    motion.input().dt = dt;
    std::vector<btScalar>& start = motion.input().start;
    for (const btVector3& p : points) start.insert(start.end(), &p[0], &p[0] + 3);
    motion.end = motion.start();
    motion.input().inverse_mass = std::move(inverse_masses);
    found_.pairs = std::move(pairs);
  }

  void begin_step() {
    Topology topology;
    topology.faces = faces_;
    topology.body_of_vertex = body_of_vertex_;
    topology.bodies = bodies_;
    untangling.begin_step({found_, {}}, topology, edges_, motion);
  }

  const Face& face(int i) const { return faces_[static_cast<std::size_t>(i)]; }

  bullet::Motion motion;
  bullet::Untangling untangling;

 private:
  std::vector<std::int32_t> body_of_vertex_;
  std::vector<Face> faces_;
  std::vector<Edge> edges_;
  std::vector<Body> bodies_ = std::vector<Body>(2);
  bullet::Intersections found_;
};

}  // namespace

TEST_CASE("a vertex inside a closed surface may pass it outwards and only there") {
  // One corner of a triangle is inside a flat pyramid. The triangle intersects the side at the x
  // axis.
  const double s = 0.866;
  Tangle tangle({at(0, 0.25, 0), at(1, 0.25, -0.1), at(1, 0.25, 0.1), at(0.5, 0, -s), at(-1, 0, 0),
                 at(0.5, 0, s), at(0, 0.3, 0)},
                {1, 1, 1, 0, 0, 0, 0}, {0, 0, 0, 1, 1, 1, 1},
                {{0, 1, 2}, {3, 4, 5}, {6, 4, 3}, {6, 5, 4}, {6, 3, 5}},
                {{0, 1}, {1, 2}, {0, 2}, {3, 4}, {4, 5}, {3, 5}, {3, 6}, {4, 6}, {5, 6}},
                {{0, 4}, {2, 4}}, 0.01);
  tangle.untangling.start();
  tangle.begin_step();
  // True for a contact of the corner with a face, from inside (sign 1) or from outside (-1).
  const auto allows_pass = [&](const Face& face, double sign) {
    const bullet::Motion& motion = tangle.motion;
    const bullet::Vector3d a = motion.start_of(face[0]), b = motion.start_of(face[1]),
                           c = motion.start_of(face[2]);
    const bullet::Vector3d inwards = sign * (b - a).cross(c - a).normalized();
    return tangle.untangling.allows_pass(
        {ContactKind::vertex_face,
         0,
         1,
         0,
         0,
         {0, face[0], face[1], face[2]},
         0.3f,
         0.3f,
         {float(inwards.x()), float(inwards.y()), float(inwards.z())},
         0.5},
        motion);
  };
  for (const int side : {2, 3, 4}) {
    CHECK(allows_pass(tangle.face(side), 1));
    CHECK(!allows_pass(tangle.face(side), -1));
  }
  CHECK(!allows_pass(tangle.face(1), 1));
}

TEST_CASE("untangling gives up bodies that cannot be moved apart") {
  // A pinned edge intersects a pinned face.
  Tangle tangle({at(0, -1, 0), at(0, 1, 0), at(-1, 0, -1), at(1, 0, -1), at(0, 0, 1)},
                {0, 0, 0, 0, 0}, {0, 0, 1, 1, 1}, {{2, 3, 4}}, {{0, 1}}, {{0, 0}}, 0.1);
  CHECK(!tangle.untangling.is_in_progress());
  tangle.untangling.start();
  for (int i = 0; i < 29; ++i) {
    tangle.begin_step();
    CHECK(tangle.untangling.is_in_progress());
    CHECK(!tangle.untangling.pushes());
  }
  for (int i = 0; i < 5; ++i) tangle.begin_step();
  CHECK(!tangle.untangling.is_in_progress());
  // Something else is placed.
  tangle.untangling.start();
  tangle.begin_step();
  CHECK(!tangle.untangling.is_in_progress());
  // One of them is placed.
  tangle.untangling.place(1);
  tangle.untangling.start();
  tangle.begin_step();
  CHECK(tangle.untangling.is_in_progress());
}
