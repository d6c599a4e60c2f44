// The functions that lazyccd.js calls, which has checked all arguments. Arrays come from reserve().
// A function that fails keeps the reason for last_error(), and returns 0 or -1.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "text/option_table.h"
#include "text/stats_text.h"
#include "world.h"

#define EXPORT(name) __attribute__((export_name(#name)))

using namespace lazyccd;
using namespace lazyccd::javascript;

namespace {

std::string error, answer;
bullet::SolverOptions options;  // of the next world

// Runs `function`; what it throws is the error.
template <class Function>
bool succeeds(const Function& function) {
  try {
    function();
    return true;
  } catch (const std::exception& e) {
    error = e.what();
  } catch (...) {
    error = "an unknown exception";
  }
  return false;
}

btVector3 vector(const float* x) { return btVector3(x[0], x[1], x[2]); }

// Seven numbers: position and rotation.
btTransform transform(const float* pose) {
  return btTransform(btQuaternion(pose[3], pose[4], pose[5], pose[6]).normalized(), vector(pose));
}

enum class Shape { box, sphere, capsule, plane, convex, mesh };

// The meaning of `numbers` is in lazyccd.js.
std::unique_ptr<btCollisionShape> make_shape(Shape kind, const float* numbers, int count,
                                             const std::int32_t* faces, int face_count,
                                             std::shared_ptr<void>& parts) {
  switch (kind) {
    case Shape::box:
      return std::make_unique<btBoxShape>(vector(numbers));
    case Shape::sphere:
      return std::make_unique<btSphereShape>(numbers[0]);
    case Shape::capsule:
      return std::make_unique<btCapsuleShape>(numbers[0], numbers[1]);
    case Shape::plane:
      return std::make_unique<btStaticPlaneShape>(vector(numbers).normalized(), numbers[3]);
    case Shape::convex: {
      auto hull = std::make_unique<btConvexHullShape>();
      for (int i = 0; i < count; i += 3) hull->addPoint(vector(numbers + i), false);
      hull->recalcLocalAabb();
      hull->setMargin(0);
      return hull;
    }
    case Shape::mesh: {
      const auto mesh = std::make_shared<btTriangleMesh>();
      for (int i = 0; i < 3 * face_count; i += 3)
        mesh->addTriangle(vector(numbers + 3 * faces[i]), vector(numbers + 3 * faces[i + 1]),
                          vector(numbers + 3 * faces[i + 2]));
      parts = mesh;
      return std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true);
    }
  }
  return nullptr;
}

}  // namespace

extern "C" {

EXPORT(reserve) void* reserve(int bytes) { return std::malloc(static_cast<std::size_t>(bytes)); }
EXPORT(release) void release(void* array) { std::free(array); }
EXPORT(last_error) const char* last_error() { return error.c_str(); }

EXPORT(clear_options) void clear_options() {
  options = {};
  options.detector.threads = 1;
  options.on_message = [](const std::string& line) {
    std::fprintf(stderr, "LazyCCD: %s\n", line.c_str());
  };
}
EXPORT(set_option) int set_option(const char* name, const char* value) {
  return succeeds([&] { text::set_option(options, name, value); });
}

EXPORT(world_new) World* world_new(int kind, int collisions, float x, float y, float z) {
  World* world = nullptr;
  succeeds([&] {
    world = new World(static_cast<Kind>(kind), static_cast<Collisions>(collisions),
                      btVector3(x, y, z), options);
  });
  return world;
}
EXPORT(world_delete) void world_delete(World* world) { delete world; }
EXPORT(world_step) int world_step(World* world, double seconds) {
  return succeeds([&] { world->step(seconds); });
}
EXPORT(world_status) const char* world_status(World* world) {
  answer = world->status();
  return answer.c_str();
}
// One line for each member of StepStats: its name, a blank, its value.
EXPORT(world_stats) const char* world_stats(World* world) {
  const bullet::StepStats* const stats = world->stats();
  answer = stats ? text::stats_text(*stats) : "";
  return answer.c_str();
}

EXPORT(soft_add)
int soft_add(World* world, const float* positions, int nodes, const std::int32_t* faces,
             int face_count, const std::int32_t* links, int link_count,
             const std::int32_t* tetrahedra, int tetrahedron_count, const std::int32_t* pinned,
             int pinned_count) {
  int body = -1;
  succeeds([&] {
    SoftBodyDescription d;
    d.positions.assign(positions, positions + 3 * nodes);
    d.faces.assign(faces, faces + 3 * face_count);
    d.links.assign(links, links + 2 * link_count);
    d.tetrahedra.assign(tetrahedra, tetrahedra + 4 * tetrahedron_count);
    d.pinned.assign(pinned, pinned + pinned_count);
    body = world->add(d);
  });
  return body;
}
EXPORT(soft_springs) void soft_springs(World* world, int body, double stiffness, double damping) {
  world->add_springs(body, stiffness, damping);
}
EXPORT(soft_elasticity)
void soft_elasticity(World* world, int body, double mu, double lambda, double damping) {
  world->add_elasticity(body, mu, lambda, damping);
}
EXPORT(soft_bending) void soft_bending(World* world, int body, int distance) {
  world->add_bending(body, distance);
}
EXPORT(soft_set) void soft_set(World* world, int body, int number, double value) {
  world->set(body, static_cast<SoftBodyNumber>(number), value);
}
EXPORT(soft_pin) void soft_pin(World* world, int body, int node, int is_pinned) {
  world->pin(body, node, is_pinned != 0);
}
EXPORT(soft_steer) void soft_steer(World* world, int body, int node, float x, float y, float z) {
  world->steer(body, node, btVector3(x, y, z));
}
EXPORT(soft_push) void soft_push(World* world, int body, int node, float x, float y, float z) {
  world->push(body, node, btVector3(x, y, z));
}
EXPORT(soft_place)
void soft_place(World* world, int body, const float* positions, const float* velocities) {
  world->place(body, positions, velocities);
}
EXPORT(soft_positions) const float* soft_positions(World* world, int body) {
  return world->positions(body).data();
}
EXPORT(soft_velocities) const float* soft_velocities(World* world, int body) {
  return world->velocities(body).data();
}

EXPORT(rigid_add)
int rigid_add(World* world, int shape, const float* numbers, int count, const std::int32_t* faces,
              int face_count, double mass, int is_kinematic, const float* pose, double friction,
              double margin) {
  int body = -1;
  succeeds([&] {
    std::shared_ptr<void> parts;
    auto made = make_shape(static_cast<Shape>(shape), numbers, count, faces, face_count, parts);
    if (margin >= 0) made->setMargin(static_cast<btScalar>(margin));
    body = world->add(std::move(made), std::move(parts), mass, is_kinematic != 0, transform(pose),
                      friction);
  });
  return body;
}
EXPORT(rigid_move) void rigid_move(World* world, int body, const float* pose) {
  world->move(body, transform(pose));
}
EXPORT(rigid_teleport) void rigid_teleport(World* world, int body, const float* pose) {
  world->teleport(body, transform(pose));
}
EXPORT(rigid_pose) const float* rigid_pose(World* world, int body) {
  return world->pose(body).data();
}
EXPORT(body_remove) void body_remove(World* world, int body) { world->remove(body); }

// Fills eight words: the number of contacts, then the addresses of the arrays of ContactArrays in
// their order.
EXPORT(world_contacts) void world_contacts(World* world, std::uintptr_t* words) {
  const ContactArrays& c = world->contacts();
  const auto address = [](const auto& array) {
    return reinterpret_cast<std::uintptr_t>(array.data());
  };
  words[0] = c.kinds.size();
  words[1] = address(c.bodies);
  words[2] = address(c.nodes);
  words[3] = address(c.kinds);
  words[4] = address(c.points);
  words[5] = address(c.normals);
  words[6] = address(c.impulses);
  words[7] = address(c.times);
}

}  // extern "C"
