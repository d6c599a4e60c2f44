// Scenes in which a cloth flies at another body.
#include "scenes/measures/sides.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/scene.h"

namespace lazyccd::scenes {
namespace {

btVector3 downwards(double speed) { return btVector3(0, static_cast<btScalar>(-speed), 0); }

// A cloth of 21 x 21 nodes, 1 m wide, flies at one of 31 x 31 nodes, 2 m wide. `scale` multiplies
// both widths.
void build_cloths(Scene& scene, const Parameters& parameters, double speed, double scale,
                  bool pinned) {
  std::mt19937 random(parameters.seed);
  PhysicsWorld& world = *scene.world;
  const int lower_nodes = scaled(31, parameters), upper_nodes = scaled(21, parameters);
  Sheet lower{lower_nodes, lower_nodes, 2 * scale, 2 * scale};
  Sheet upper{upper_nodes, upper_nodes, scale, scale};
  lower.jitter = upper.jitter = 0.002 * scale;
  upper.height = 0.2 * scale;
  upper.angle = 0.3;
  auto lower_cloth = make_sheet(world.info(), lower, random);
  auto upper_cloth = make_sheet(world.info(), upper, random);
  if (pinned) pin_border(*lower_cloth, lower_nodes, lower_nodes);
  upper_cloth->setVelocity(downwards(speed));
  const btSoftBody* below = lower_cloth.get();
  const btSoftBody* above = upper_cloth.get();
  world.add(std::move(lower_cloth));
  world.add(std::move(upper_cloth));
  scene.nodes_on_wrong_side = [=] {
    return nodes_below(*above, 0, above->m_nodes.size() - 1, *below);
  };
}

void build_cloth_on_mesh(Scene& scene, const Parameters& parameters, double speed) {
  std::mt19937 random(parameters.seed);
  PhysicsWorld& world = *scene.world;
  const auto flat = [](double u, double v) { return vector(3 * u - 1.5, 0, 3 * v - 1.5); };
  world.add_static(make_mesh(20, 20, flat), at(0, 0, 0));
  const int nodes = scaled(21, parameters);
  Sheet sheet{nodes, nodes, 1, 1};
  sheet.height = 0.2;
  sheet.angle = 0.3;
  sheet.jitter = 0.002;
  auto cloth = make_sheet(world.info(), sheet, random);
  cloth->setVelocity(downwards(speed));
  const btSoftBody* thrown = cloth.get();
  world.add(std::move(cloth));
  scene.nodes_on_wrong_side = [thrown] {
    int below = 0;
    for (int i = 0; i < thrown->m_nodes.size(); ++i) below += thrown->m_nodes[i].m_x.y() < 0;
    return below;
  };
}

// Two upright squares meet edge to edge, far from all nodes.
void build_edge_on_edge(Scene& scene, const Parameters&, double speed) {
  PhysicsWorld& world = *scene.world;
  auto lower = make_cloth(world.info(), 2, 2, 1, [](double u, double v) {
    return btVector3(0, static_cast<btScalar>(v - 1), static_cast<btScalar>(u - 0.47));
  });
  auto upper = make_cloth(world.info(), 2, 2, 1, [](double u, double v) {
    return btVector3(static_cast<btScalar>(u - 0.52), static_cast<btScalar>(v + 0.2), 0);
  });
  pin(*lower, 0, 3);
  upper->setVelocity(downwards(speed));
  const btSoftBody* fixed = lower.get();
  const btSoftBody* thrown = upper.get();
  world.add(std::move(lower));
  world.add(std::move(upper));
  scene.nodes_on_wrong_side = [=] {
    // Compares the point of the thrown square's lower edge at x = 0 with the top edge at y = 0.
    const btVector3 &a = thrown->m_nodes[0].m_x, &b = thrown->m_nodes[1].m_x;
    if ((a.x() < 0) == (b.x() < 0)) return 0;
    const btScalar t = a.x() / (a.x() - b.x());
    const btVector3 p = a + t * (b - a);
    const bool beside = p.z() < fixed->m_nodes[2].m_x.z() || p.z() > fixed->m_nodes[3].m_x.z();
    return !beside && p.y() < 0 ? 2 : 0;
  };
}

SceneInfo thrown(const char* name, const char* description, double speed, double distance) {
  SceneInfo info;
  info.name = name;
  info.description = description;
  info.speed = speed;
  info.distance = distance;
  info.seconds = 0.2;
  return info;
}

}  // namespace

std::vector<SceneInfo> impact_scenes() {
  SceneInfo cloths =
      thrown("cloth-on-cloth", "a cloth flies into a larger cloth that is pinned along its border",
             10, 0.5);
  cloths.build = [](Scene& scene, const Parameters& p, double speed) {
    build_cloths(scene, p, speed, 1, true);
  };

  SceneInfo small =
      thrown("small-triangles", "cloth-on-cloth with all lengths divided by five", 0.4, 0.1);
  small.margin = 0.002;
  small.build = [](Scene& scene, const Parameters& p, double speed) {
    build_cloths(scene, p, speed, 0.2, true);
  };

  SceneInfo free = thrown(
      "free-cloths", "cloth-on-cloth with nothing pinned, so that momentum is conserved", 10, 0.5);
  free.build = [](Scene& scene, const Parameters& p, double speed) {
    build_cloths(scene, p, speed, 1, false);
  };

  SceneInfo mesh =
      thrown("cloth-on-mesh", "a cloth is thrown down on a flat static triangle mesh", 10, 0);
  mesh.gravity = 10;
  mesh.seconds = 1;
  mesh.build = build_cloth_on_mesh;

  SceneInfo edges = thrown(
      "edge-on-edge", "two upright squares meet edge to edge; the lower one is pinned", 1, 0.5);
  edges.build = build_edge_on_edge;
  return {cloths, small, free, mesh, edges};
}

}  // namespace lazyccd::scenes
