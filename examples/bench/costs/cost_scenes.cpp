#include "bench/costs/cost_scenes.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <utility>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::scenes {
namespace {

using MakeShape = std::function<std::unique_ptr<btCollisionShape>()>;

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

void drop_soft_balls_into_box(PhysicsWorld& world) {
  add_ground(world, true);
  for (const double side : {-1.0, 1.0}) {
    world.add_static(make_box(0.1, 2, 2), at(0.75 * side, 1, 0));
    world.add_static(make_box(2, 2, 0.1), at(0, 1, 0.75 * side));
  }
  for (int i = 0; i < 30; ++i) {
    const int layer = i / 9, place = i % 9;
    auto ball =
        make_ball(world.info(), 2, 0.1,
                  vector(0.4 * (place % 3 - 1), 0.3 + 0.4 * layer, 0.4 * (place / 3 - 1)), 0.15);
    world.add(std::move(ball));
  }
}

// Blades of grass, and a ball that rolls over them.
void roll_ball_over_grass(PhysicsWorld& world) {
  add_ground(world, true);
  for (int i = 0; i < 100; ++i) {
    const double x = 0.3 * (i % 10) - 1.35, z = 0.3 * (i / 10) - 1.35;
    auto blade = make_rope(world.info(), 4, 0.02, vector(x, 0.02, z), vector(x, 0.3, z));
    blade->setMass(0, 0);
    world.add(std::move(blade));
  }
  btRigidBody& ball =
      world.add_dynamic(std::make_unique<btSphereShape>(btScalar(0.2)), at(-1.6, 0.25, 0), 1);
  ball.setLinearVelocity(vector(2, 0, 0));
}

// Pages of a book, held at the spine.
void turn_pages(PhysicsWorld& world) {
  add_ground(world, true);
  for (int i = 0; i < 10; ++i) {
    constexpr int nodes = 7;
    btSoftBody* const page = add_cloth(world, nodes, 0.5, vector(0, 0.1 + 0.02 * i, 0));
    for (int k = 0; k < nodes; ++k) page->setMass(k, 0);
    page->addVelocity(vector(0, 0.1 * i, 0));
  }
}

// A box falls on the others every tenth of a second.
void drop_soft_boxes(PhysicsWorld& world) {
  add_ground(world, true);
  for (int i = 0; i < 10; ++i) {
    world.add(make_solid(world.info(), 1, 0.5, [i](double u, double v, double w) {
      return vector(0.3 * u + 0.02 * i, 0.3 * v + 0.3 + 0.8 * i, 0.3 * w);
    }));
  }
}

void throw_cloth_at_ball(PhysicsWorld& world, double speed, double voxel) {
  world.info().m_sparsesdf.setDefaultVoxelsz(static_cast<btScalar>(voxel));
  world.add_static(std::make_unique<btSphereShape>(btScalar(0.3)), at(0, 0, 0));
  add_cloth(world, 31, 1.2, vector(0, 0.6, 0))->addVelocity(vector(0, -speed, 0));
}

// As applications have them that set no margin.
std::vector<CostScene> untuned_scenes() {
  std::vector<CostScene> scenes;
  const auto add = [&scenes](const std::string& name, std::function<void(PhysicsWorld&)> build,
                             double gravity = 10) {
    scenes.push_back({name + ", untuned", std::move(build)});
    scenes.back().untuned = true;
    scenes.back().gravity = gravity;
  };
  // The second and third: a unit of length is a metre, or a centimetre.
  for (const double unit : {1.0, 100.0}) {
    const std::string suffix = unit == 1 ? "" : ", in centimetres";
    add(
        "cloth of 25 x 25 on a box" + suffix,
        [unit](PhysicsWorld& w) {
          w.add_static(make_box(0.6 * unit, 0.6 * unit, 0.6 * unit), at(0, 0, 0));
          add_cloth(w, 25, 1.2 * unit, vector(0, 0.6 * unit, 0));
        },
        10 * unit);
    add(
        "cloth of 13 x 13 on a ball" + suffix,
        [unit](PhysicsWorld& w) {
          w.add_static(shape<btSphereShape>(0.3 * unit)(), at(0, 0, 0));
          add_cloth(w, 13, 1.2 * unit, vector(0, 0.6 * unit, 0));
        },
        10 * unit);
    add(
        "soft ball on a large box" + suffix,
        [unit](PhysicsWorld& w) {
          w.add_static(make_box(20 * unit, unit, 20 * unit), at(0, -0.5 * unit, 0));
          add_ball(w, vector(0, 0.8 * unit, 0), 0.4 * unit);
        },
        10 * unit);
  }
  add("five hulls on a pinned cloth", drop_hulls_on_pinned_cloth);
  add("ball and 49 ropes", drop_ball_into_ropes);
  add("five sliding soft boxes", slide_soft_boxes);
  add("thirty soft balls in a box", drop_soft_balls_into_box);
  scenes.back().rigid_only = true;
  add("ball over a hundred blades of grass", roll_ball_over_grass);
  add("ten pages of a book", turn_pages);
  scenes.back().rigid_only = true;
  add("ten soft boxes, one after another", drop_soft_boxes);
  for (const double voxel : {0.25, 0.05}) {
    for (const double speed : {0.0, 10.0, 30.0}) {
      char name[96];
      std::snprintf(name, sizeof name, "cloth of 31 x 31 on a ball at %g m/s, voxels of %g m",
                    speed, voxel);
      add(name, [=](PhysicsWorld& w) { throw_cloth_at_ball(w, speed, voxel); });
    }
  }
  return scenes;
}

}  // namespace

void Character::add(std::unique_ptr<btCollisionShape> child, const btTransform& pose) {
  addChildShape(pose, child.get());
  Triangles surface = tessellate(*child);
  parts_.push_back({std::move(child), pose, std::move(surface)});
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
  for (CostScene& scene : reported_scenes()) scenes.push_back(std::move(scene));
  for (CostScene& scene : untuned_scenes()) scenes.push_back(std::move(scene));
  return scenes;
}

}  // namespace lazyccd::scenes
