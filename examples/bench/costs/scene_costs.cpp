// The programs lazyccd_scene_costs and lazyccd_scene_costs_double: measure the time of a step in
// scenes that are common in games, with Bullet alone and with LazyCCD.
//
//   lazyccd_scene_costs [--rounds N] [--only TEXT] [--world NAME] [--csv FILE] [--cpu-time]
//
// The table has milliseconds of a whole step, over one second from the start, and the largest depth
// of a node in a rigid body, sampled twenty times a second. Runs with Bullet alone and with LazyCCD
// take turns; times are medians over the rounds. Run it on an idle machine.
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <LinearMath/btAabbUtil2.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bench/machine.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {
namespace {

constexpr const char* precision = sizeof(btScalar) == sizeof(float) ? "float" : "double";

struct CostScene {
  std::string name;
  std::function<void(PhysicsWorld&)> build;
  double seconds = 1;
  // Steps that are not timed: they build persistent data, and sleepers are left out after some.
  int warm_up_steps = 1;
  bool only_by_name = false;  // takes so long that it runs only if --only names it
  bool untuned = false;       // margins are Bullet's defaults
};

using MakeShape = std::function<std::unique_ptr<btCollisionShape>()>;

// A compound shape that owns its children and knows their surfaces.
class Character : public btCompoundShape {
 public:
  struct Part {
    std::unique_ptr<btCollisionShape> shape;
    btTransform pose;
    Triangles surface;
  };

  void add(std::unique_ptr<btCollisionShape> child, const btTransform& pose) {
    addChildShape(pose, child.get());
    Triangles surface = tessellate(*child);
    parts_.push_back({std::move(child), pose, std::move(surface)});
  }
  const std::vector<Part>& parts() const { return parts_; }

 private:
  std::vector<Part> parts_;
};

template <class Shape, class... Sizes>
MakeShape shape(Sizes... sizes) {
  return [=] { return std::make_unique<Shape>(static_cast<btScalar>(sizes)...); };
}

// A convex hull of points on a ball.
std::unique_ptr<btCollisionShape> make_hull(std::mt19937& random, int points, double radius) {
  auto hull = std::make_unique<btConvexHullShape>();
  std::normal_distribution<double> normal;
  for (int i = 0; i < points; ++i) {
    const btVector3 p = vector(normal(random), normal(random), normal(random));
    hull->addPoint(p.normalized() * static_cast<btScalar>(radius), false);
  }
  hull->recalcLocalAabb();
  return hull;
}

// Returns the shapes. Each is about 0.6 m wide and high and centred in the origin.
std::vector<std::pair<std::string, MakeShape>> shapes() {
  const MakeShape hull = [] {
    std::mt19937 random(3);
    return make_hull(random, 24, 0.3);
  };
  // A body, a head and two arms.
  const auto character_with = [](const MakeShape& body) {
    auto character = std::make_unique<Character>();
    character->add(body(), at(0, 0, 0));
    character->add(shape<btSphereShape>(0.15)(), at(0, 0.45, 0));
    for (const double side : {-1.0, 1.0})
      character->add(shape<btCapsuleShape>(0.07, 0.4)(), at(side * 0.3, 0.1, 0));
    return character;
  };
  return {{"capsule", shape<btCapsuleShape>(0.25, 0.4)},
          {"sphere", shape<btSphereShape>(0.3)},
          {"box", [] { return make_box(0.6, 0.6, 0.6); }},
          {"cylinder", [] { return std::make_unique<btCylinderShape>(vector(0.3, 0.3, 0.3)); }},
          {"cone", shape<btConeShape>(0.3, 0.6)},
          {"hull", hull},
          {"compound", [=] { return character_with(shape<btCapsuleShape>(0.2, 0.3)); }},
          {"compound with a box",
           [=] { return character_with([] { return make_box(0.4, 0.6, 0.3); }); }}};
}

btSoftBody* add_cloth(PhysicsWorld& world, int nodes, double width, const btVector3& middle) {
  std::mt19937 random(1);
  Sheet sheet{nodes, nodes, width, width};
  sheet.angle = 0.3;
  sheet.jitter = 0.002;
  auto cloth = make_sheet(world.info(), sheet, random);
  cloth->translate(middle);
  btSoftBody* const added = cloth.get();
  world.add(std::move(cloth));
  return added;
}

enum class Kind { still, driven, free };

void drape(PhysicsWorld& world, std::unique_ptr<btCollisionShape> shape, Kind kind) {
  btVector3 lower, upper;
  shape->getAabb(at(0, 0, 0), lower, upper);
  const double height = static_cast<double>(upper.y()), depth = static_cast<double>(lower.y());
  if (kind == Kind::still) {
    world.add_static(std::move(shape), at(0, 0, 0));
  } else if (kind == Kind::driven) {
    world.add_moving(std::move(shape), [](double time) {
      btTransform pose = at(0.1 * std::sin(3 * time), 0, 0);
      pose.setRotation(btQuaternion(vector(0, 1, 0), static_cast<btScalar>(time)));
      return pose;
    });
  } else {
    world.add_dynamic(std::move(shape), at(0, 0, 0), 5);
    world.add_static(make_box(4, 0.2, 4), at(0, depth - 0.12, 0));
  }
  add_cloth(world, 25, 1.2, vector(0, height + 0.05, 0));
}

void add_rope(PhysicsWorld& world, const btVector3& from, const btVector3& to) {
  world.add(make_rope(world.info(), 25, 0.3, from, to));
}

btSoftBody* add_ball(PhysicsWorld& world, const btVector3& centre, double radius) {
  if (world.options().world == World::deformable) {
    // Light, because with a larger mass the springs would let it collapse to a plane.
    auto ball = make_ball(world.info(), 4, 0.1, centre, radius);
    btSoftBody* const added = ball.get();
    world.add(std::move(ball));
    return added;
  }
  const btScalar r = static_cast<btScalar>(radius);
  std::unique_ptr<btSoftBody> ball(
      btSoftBodyHelpers::CreateEllipsoid(world.info(), centre, btVector3(r, r, r), 256));
  ball->setTotalMass(1);
  btSoftBody* const added = ball.get();
  world.add(std::move(ball));
  added->m_cfg.kPR = 100;
  return added;
}

void add_ground(PhysicsWorld& world, bool box) {
  if (box) {
    world.add_static(make_box(20, 1, 20), at(0, -0.5, 0));
  } else {
    world.add_static(std::make_unique<btStaticPlaneShape>(vector(0, 1, 0), btScalar(0)),
                     at(0, 0, 0));
  }
}

// As PyBullet's example deformable_anchor.py: two corners are pinned, a box of 1 kg hangs on the
// others.
void build_anchored(PhysicsWorld& world) {
  constexpr int nodes = 5;
  btSoftBody* const cloth = add_cloth(world, nodes, 1, vector(0, 0, 0));
  for (const int node : {0, nodes - 1}) cloth->setMass(node, 0);
  btRigidBody& box = world.add_dynamic(make_box(1, 1, 1), at(0, 0, 1.05), 1);
  for (const int node : {nodes * (nodes - 1), nodes * nodes - 1}) {
    if (world.options().world == World::rigid) {
      cloth->appendAnchor(node, &box, true);
    } else {
      cloth->appendDeformableAnchor(node, &box);
    }
  }
}

void build_tiny_bodies(PhysicsWorld& world) {
  for (int i = 0; i < 100; ++i) add_cloth(world, 3, 0.1, vector(2 * (i % 10), 1, 2 * (i / 10)));
}

void let_sleep(PhysicsWorld& world) {
  for (const auto& body : world.bodies()) body->forceActivationState(ISLAND_SLEEPING);
}

// One cloth falls on a box. `sleepers` others sleep beside it, 3 m apart.
CostScene among_sleepers(int sleepers) {
  const auto build = [sleepers](PhysicsWorld& world) {
    for (int i = 1; i <= sleepers; ++i)
      add_cloth(world, 25, 1.2, vector(3 * (i % 32), 0, 3 * (i / 32)));
    let_sleep(world);
    world.add_static(make_box(0.6, 0.6, 0.6), at(-3, 0, 0));
    add_cloth(world, 25, 1.2, vector(-3, 0.35, 0));
  };
  return {"cloth on a box among " + std::to_string(sleepers) + " cloths asleep", build, 0.5, 20,
          sleepers > 100};
}

// The first steps of two sheets at the same place, or nearly.
CostScene coincident_sheets(int nodes, double gap) {
  const auto build = [nodes, gap](PhysicsWorld& world) {
    add_cloth(world, nodes, 1, vector(0, 0, 0));
    add_cloth(world, nodes, 1, vector(0, gap, 0));
  };
  return {"two sheets of " + std::to_string(nodes) + " x " + std::to_string(nodes) +
              (gap == 0 ? " at one place" : " a micrometre apart") + ", first steps",
          build, 1.0 / 60, 0};
}

void drop_hulls_on_pinned_cloth(PhysicsWorld& world) {
  constexpr int nodes = 21;
  btSoftBody* const cloth = add_cloth(world, nodes, 2, vector(0, 0, 0));
  for (const int corner : {0, nodes - 1, nodes * (nodes - 1), nodes * nodes - 1})
    cloth->setMass(corner, 0);
  std::mt19937 random(4);
  for (int i = 0; i < 5; ++i)
    world.add_dynamic(make_hull(random, 12, 0.15), at(0.3 * (i - 2), 0.6 + 0.2 * i, 0), 0.1);
}

void drop_ball_into_ropes(PhysicsWorld& world) {
  for (int i = 0; i < 49; ++i) {
    const double x = 0.2 * (i % 7 - 3), z = 0.2 * (i / 7 - 3);
    auto rope = make_rope(world.info(), 8, 0.1, vector(x, 0, z), vector(x, 0.7, z));
    rope->setMass(0, 0);
    world.add(std::move(rope));
  }
  world.add_dynamic(std::make_unique<btSphereShape>(btScalar(0.3)), at(0, 1.2, 0), 1);
}

void slide_soft_boxes(PhysicsWorld& world) {
  add_ground(world, true);
  for (int i = 0; i < 5; ++i) {
    auto box = make_solid(world.info(), 2, 1, [i](double u, double v, double w) {
      return vector(i + 0.4 * u, 0.4 * v + 0.3, 0.4 * w);
    });
    box->setVelocity(vector(0, 0, 2));
    world.add(std::move(box));
  }
}

// As applications have them that set no margin.
std::vector<CostScene> untuned_scenes() {
  std::vector<CostScene> scenes;
  const auto add = [&scenes](const char* name, std::function<void(PhysicsWorld&)> build) {
    scenes.push_back({std::string(name) + ", untuned", std::move(build)});
    scenes.back().untuned = true;
  };
  add("cloth of 25 x 25 on a box", [](PhysicsWorld& w) {
    w.add_static(make_box(0.6, 0.6, 0.6), at(0, 0, 0));
    add_cloth(w, 25, 1.2, vector(0, 0.6, 0));
  });
  add("cloth of 13 x 13 on a ball", [](PhysicsWorld& w) {
    w.add_static(std::make_unique<btSphereShape>(btScalar(0.3)), at(0, 0, 0));
    add_cloth(w, 13, 1.2, vector(0, 0.6, 0));
  });
  add("five hulls on a pinned cloth", drop_hulls_on_pinned_cloth);
  add("soft ball on a large box", [](PhysicsWorld& w) {
    add_ground(w, true);
    add_ball(w, vector(0, 0.8, 0), 0.4);
  });
  add("ball and 49 ropes", drop_ball_into_ropes);
  add("five sliding soft boxes", slide_soft_boxes);
  return scenes;
}

std::vector<CostScene> cost_scenes() {
  std::vector<CostScene> scenes;
  const std::pair<const char*, Kind> kinds[] = {
      {"static", Kind::still}, {"kinematic", Kind::driven}, {"dynamic", Kind::free}};
  for (const auto& [name, make] : shapes()) {
    for (const auto& [way, kind] : kinds) {
      scenes.push_back({"cloth on a " + std::string(way) + " " + name,
                        [make = make, kind = kind](PhysicsWorld& w) { drape(w, make(), kind); }});
    }
  }
  const auto add = [&](const char* name, std::function<void(PhysicsWorld&)> build) {
    scenes.push_back({name, std::move(build)});
  };
  add("cloth on a plane", [](PhysicsWorld& w) {
    add_ground(w, false);
    add_cloth(w, 25, 1.2, vector(0, 0.1, 0));
  });
  add("cloth on a large box", [](PhysicsWorld& w) {
    add_ground(w, true);
    add_cloth(w, 25, 1.2, vector(0, 0.1, 0));
  });
  add("cloth on a terrain of triangles", [](PhysicsWorld& w) {
    // As fine as the cloth.
    w.add_static(make_mesh(40, 40,
                           [](double u, double v) {
                             const double x = 2 * u - 1, z = 2 * v - 1;
                             return vector(x, 0.05 * std::sin(4 * x) * std::cos(3 * z), z);
                           }),
                 at(0, 0, 0));
    add_cloth(w, 25, 1.2, vector(0, 0.15, 0));
  });
  add("one rope, falling", [](PhysicsWorld& w) { add_rope(w, vector(-1, 0, 0), vector(1, 0, 0)); });
  add("ten ropes, falling", [](PhysicsWorld& w) {
    for (int i = 0; i < 10; ++i) add_rope(w, vector(-1, 0, 0.3 * i), vector(1, 0, 0.3 * i));
  });
  add("one rope over a box", [](PhysicsWorld& w) {
    w.add_static(make_box(0.6, 0.6, 0.6), at(0, 0, 0));
    add_rope(w, vector(-1, 0.4, 0), vector(1, 0.4, 0.1));
  });
  add("one rope over a capsule", [](PhysicsWorld& w) {
    w.add_static(shape<btCapsuleShape>(0.25, 0.4)(), at(0, 0, 0));
    add_rope(w, vector(-1, 0.5, 0), vector(1, 0.5, 0.1));
  });
  add("soft ball on a plane", [](PhysicsWorld& w) {
    add_ground(w, false);
    add_ball(w, vector(0, 0.6, 0), 0.5);
  });
  add("soft ball on a large box", [](PhysicsWorld& w) {
    add_ground(w, true);
    add_ball(w, vector(0, 0.6, 0), 0.5);
  });
  add("soft ball with clusters on a large box", [](PhysicsWorld& w) {
    add_ground(w, true);
    btSoftBody* const ball = add_ball(w, vector(0, 0.6, 0), 0.5);
    ball->generateClusters(16);
    ball->m_cfg.collisions |= btSoftBody::fCollision::CL_SS;
    if (w.options().world == World::rigid)
      ball->m_cfg.collisions = btSoftBody::fCollision::CL_SS | btSoftBody::fCollision::CL_RS;
  });
  add("one cloth far from a box", [](PhysicsWorld& w) {
    w.add_static(make_box(1, 1, 1), at(100, 0, 0));
    add_cloth(w, 25, 1.2, vector(0, 0, 0));
  });
  add("one cloth alone", [](PhysicsWorld& w) { add_cloth(w, 25, 1.2, vector(0, 0, 0)); });
  add("cloth of 25 nodes, anchored to a box", build_anchored);
  add("a hundred tiny cloths above a plane", [](PhysicsWorld& w) {
    add_ground(w, false);
    build_tiny_bodies(w);
  });
  add("a hundred tiny cloths alone", build_tiny_bodies);
  add("a hundred tiny cloths alone, asleep", [](PhysicsWorld& w) {
    build_tiny_bodies(w);
    let_sleep(w);
  });
  add("cloth among a hundred boxes far away", [](PhysicsWorld& w) {
    for (int i = 0; i < 100; ++i)
      w.add_static(make_box(1, 1, 1), at(5 * (i % 10 + 1), 0, 5 * (i / 10 + 1)));
    add_cloth(w, 25, 1.2, vector(-5, 0, -5));
  });
  add("rope among a thousand boxes far away", [](PhysicsWorld& w) {
    for (int i = 0; i < 1000; ++i)
      w.add_static(make_box(1, 1, 1), at(5 * (i % 32 + 1), 0, 5 * (i / 32 + 1)));
    add_rope(w, vector(-5, 0, -5), vector(-4, 0, -5));
  });
  for (const int nodes : {20, 50})
    for (const double gap : {0.0, 1e-6}) scenes.push_back(coincident_sheets(nodes, gap));
  for (const int sleepers : {0, 10, 50, 1000}) scenes.push_back(among_sleepers(sleepers));
  for (CostScene& scene : untuned_scenes()) scenes.push_back(std::move(scene));
  return scenes;
}

struct Cost {
  double ms = 0;       // mean time of a step
  double deepest = 0;  // m: largest depth of a node in a rigid body, over all samples
};

// Returns how deep a point is inside a convex hull that contains the origin, metres; 0: outside.
double depth_in(const Triangles& hull, const btVector3& p) {
  const std::vector<btVector3>& x = hull.vertices;
  btScalar min_depth = hull.faces.empty() ? 0 : BT_LARGE_FLOAT;
  for (const Face& face : hull.faces) {
    const btVector3 across = (x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]);
    if (across.fuzzyZero()) continue;
    const btScalar outwards = across.dot(x[face[0]]) > 0 ? 1 : -1;
    min_depth = btMin(min_depth, outwards * across.dot(x[face[0]] - p) / across.length());
    if (min_depth < 0) return 0;
  }
  return static_cast<double>(min_depth);
}

// Returns how deep a point is inside a convex body, a character or a plane, metres.
double depth_in(const RigidBody& rigid, const btVector3& point) {
  const btVector3 p = rigid.body->getWorldTransform().invXform(point);
  if (const auto* plane = dynamic_cast<const btStaticPlaneShape*>(rigid.shape.get()))
    return static_cast<double>(plane->getPlaneConstant() - plane->getPlaneNormal().dot(p));
  double deepest = rigid.shape->isConvex() ? depth_in(rigid.surface, p) : 0;
  if (const auto* character = dynamic_cast<const Character*>(rigid.shape.get())) {
    for (const Character::Part& part : character->parts())
      deepest = std::max(deepest, depth_in(part.surface, part.pose.invXform(p)));
  }
  return deepest;
}

double deepest_node(const PhysicsWorld& world) {
  double deepest = 0;
  for (const RigidBody& rigid : world.rigid_bodies()) {
    btVector3 lower, upper;
    rigid.shape->getAabb(rigid.body->getWorldTransform(), lower, upper);
    for (const auto& body : world.bodies()) {
      for (int i = 0; i < body->m_nodes.size(); ++i) {
        const btVector3& x = body->m_nodes[i].m_x;
        if (TestPointAgainstAabb2(lower, upper, x)) deepest = std::max(deepest, depth_in(rigid, x));
      }
    }
  }
  return deepest;
}

// Returns the time in milliseconds: the processor time of this process, or wall time.
double now(bool processor_time) {
  if (processor_time) return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  const auto time = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(time).count();
}

Cost run(const CostScene& scene, WorldOptions options, bool processor_time) {
  constexpr int samples_per_second = 20;
  options.gravity = 10;
  if (processor_time) options.lazyccd.detector.threads = 1;
  if (scene.untuned) options.margin = CONVEX_DISTANCE_MARGIN;
  const auto world = PhysicsWorld::make(options);
  scene.build(*world);
  constexpr btScalar soft_margin(0.25);  // btSoftBody's own
  for (const auto& body : world->bodies())
    if (scene.untuned) body->getCollisionShape()->setMargin(soft_margin);
  const int steps = static_cast<int>(std::lround(scene.seconds / options.dt));
  const int steps_per_sample = static_cast<int>(std::lround(1 / (samples_per_second * options.dt)));
  for (int i = 0; i < scene.warm_up_steps; ++i) world->step();
  Cost cost;
  for (int i = 0; i < steps; i += steps_per_sample) {
    const double begin = now(processor_time);
    for (int k = i; k < std::min(steps, i + steps_per_sample); ++k) world->step();
    cost.ms += (now(processor_time) - begin) / steps;
    cost.deepest = std::max(cost.deepest, deepest_node(*world));
  }
  return cost;
}

struct Request {
  int rounds = 5;
  std::string only, world, csv;
  bool processor_time = false;
};

struct Comparison {
  Cost alone, ours;
};

Comparison compare(const CostScene& scene, WorldOptions options, const Request& request) {
  Comparison result;
  std::vector<double> alone, ours;
  for (int i = 0; i < request.rounds; ++i) {
    options.collisions = Collisions::bullet;
    result.alone = run(scene, options, request.processor_time);
    alone.push_back(result.alone.ms);
    options.collisions = Collisions::lazyccd;
    result.ours = run(scene, options, request.processor_time);
    ours.push_back(result.ours.ms);
  }
  result.alone.ms = bench::median(alone);
  result.ours.ms = bench::median(ours);
  return result;
}

void write(std::ostream& csv, const std::string& scene, const char* world, int rate,
           const Comparison& c) {
  csv << '"' << scene << "\"," << world << ',' << precision << ',' << rate << ',' << c.alone.ms
      << ',' << c.ours.ms << ',' << 1e3 * c.alone.deepest << ',' << 1e3 * c.ours.deepest << ','
      << bench::machine() << std::endl;
}

void print_table(const Request& request) {
  std::ofstream csv;
  if (!request.csv.empty()) {
    csv.open(request.csv);
    csv << "scene,world,precision,steps a second,Bullet ms a step,LazyCCD ms a step,Bullet sunk in "
           "mm,LazyCCD sunk in mm,machine\n";
  }
  std::printf(
      "| scene, %s | world | 1/60 s: Bullet | LazyCCD | ratio | depth, mm | 1/240 s: "
      "Bullet | LazyCCD | ratio | depth, mm |\n|---|---|---|---|---|---|---|---|---|---|\n",
      precision);
  for (const CostScene& scene : cost_scenes()) {
    if (scene.name.find(request.only) == std::string::npos) continue;
    if (scene.only_by_name && scene.name != request.only) continue;
    for (const World world : {World::rigid, World::deformable}) {
      const char* const name = world == World::rigid ? "rigid" : "deformable";
      if (!request.world.empty() && request.world != name) continue;
      std::printf("| %s | %s |", scene.name.c_str(), name);
      for (const int rate : {60, 240}) {
        WorldOptions options;
        options.world = world;
        options.dt = 1.0 / rate;
        const Comparison c = compare(scene, options, request);
        std::printf(" %.3f | %.3f | %.2f | %.1f / %.1f |", c.alone.ms, c.ours.ms,
                    c.ours.ms / c.alone.ms, 1e3 * c.alone.deepest, 1e3 * c.ours.deepest);
        if (csv.is_open()) write(csv, scene.name, name, rate, c);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace lazyccd::scenes

int main(int argc, char** argv) {
  CLI::App app("The time of a step in common scenes: Bullet alone against LazyCCD");
  lazyccd::scenes::Request request;
  app.add_option("--rounds", request.rounds,
                 "number of runs of each scene; the median is reported");
  app.add_option("--only", request.only, "only scenes whose names contain this text");
  app.add_option("--world", request.world, "only this world: rigid or deformable");
  app.add_option("--csv", request.csv, "write all measurements to this file");
  app.add_flag("--cpu-time", request.processor_time,
               "measure processor time with one thread, for a machine that is not idle");
  CLI11_PARSE(app, argc, argv);
  lazyccd::scenes::print_table(request);
  return 0;
}
