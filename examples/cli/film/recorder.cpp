#include "cli/film/recorder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "scenes/measures/intersections.h"
#include "scenes/meshes/surface.h"

namespace lazyccd::program {
namespace {

using render::Colour;
using render::Point;

constexpr int frames_per_second = 25;
constexpr double aspect = 0.625;  // height of a picture divided by its width

const Colour stone = {0.42f, 0.43f, 0.46f};

// Colours of the two sides of a body.
struct SideColours {
  Colour front, back;
};
const SideColours palette[] = {
    {{0.86f, 0.33f, 0.06f}, {0.62f, 0.20f, 0.03f}}, {{0.06f, 0.30f, 0.72f}, {0.03f, 0.18f, 0.48f}},
    {{0.05f, 0.52f, 0.30f}, {0.03f, 0.34f, 0.19f}}, {{0.88f, 0.62f, 0.08f}, {0.66f, 0.43f, 0.04f}},
    {{0.55f, 0.12f, 0.42f}, {0.36f, 0.07f, 0.28f}}, {{0.10f, 0.55f, 0.66f}, {0.06f, 0.36f, 0.44f}},
};

Point point(const btVector3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

template <class Visit>
void each_point(const scenes::PhysicsWorld& world, Visit visit) {
  for (const auto& body : world.bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) visit(body->m_nodes[i].m_x);
  }
  for (const scenes::RigidBody& rigid : world.rigid_bodies()) {
    for (const btVector3& v : rigid.surface.vertices) visit(rigid.body->getWorldTransform() * v);
  }
}

void add_soft(const btSoftBody& body, const SideColours& colours, float rope_radius,
              render::Picture& picture) {
  std::vector<Point> points;
  for (int i = 0; i < body.m_nodes.size(); ++i) points.push_back(point(body.m_nodes[i].m_x));
  const auto index = [&body](const btSoftBody::Node* node) {
    return static_cast<std::int32_t>(node - &body.m_nodes[0]);
  };
  if (body.m_faces.size() == 0) {
    render::Rope rope{points, {}, rope_radius, colours.front};
    for (int i = 0; i < body.m_links.size(); ++i) {
      rope.links.push_back({index(body.m_links[i].m_n[0]), index(body.m_links[i].m_n[1])});
    }
    picture.ropes.push_back(std::move(rope));
    return;
  }
  render::Mesh mesh{
      points, {}, colours.front, body.m_tetras.size() > 0 ? colours.front : colours.back};
  for (int i = 0; i < body.m_faces.size(); ++i) {
    const auto& corners = body.m_faces[i].m_n;
    mesh.faces.push_back({index(corners[0]), index(corners[1]), index(corners[2])});
  }
  picture.meshes.push_back(std::move(mesh));
}

void add_rigid(const scenes::RigidBody& rigid, render::Picture& picture) {
  render::Mesh mesh;
  for (const btVector3& v : rigid.surface.vertices) {
    mesh.vertices.push_back(point(rigid.body->getWorldTransform() * v));
  }
  mesh.faces = rigid.surface.faces;
  mesh.front = mesh.back = stone;
  mesh.crease = 0.6f;
  picture.meshes.push_back(std::move(mesh));
}

}  // namespace

Recorder::Recorder(const scenes::Scene& scene, const std::filesystem::path& folder, int width,
                   int samples)
    : scene_(scene),
      folder_(folder),
      width_(width),
      height_(static_cast<int>(std::lround(width * aspect))),
      samples_(samples),
      film_(width_, height_, frames_per_second) {
  std::filesystem::create_directories(folder);
  // The view shows all bodies at the start, from the front, a little from the right and above.
  btVector3 low(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT), high = -low;
  each_point(*scene.world, [&](const btVector3& p) {
    low.setMin(p);
    high.setMax(p);
  });
  // The target is below the centre, because the thrown bodies move down.
  const btVector3 centre =
      low.lerp(high, btScalar(0.5)) - (high - low) * btVector3(0, btScalar(0.34), 0);
  extent_ = static_cast<double>((high - low).length()) / 2;
  const double distance = 0.72 * extent_ / std::sin(0.5 * static_cast<double>(camera_.field));
  const btVector3 towards = btVector3(btScalar(0.4), btScalar(0.55), btScalar(0.8)).normalized();
  camera_.target = point(centre);
  camera_.eye = point(centre + towards * static_cast<btScalar>(distance));
  const double floor_gap = scene.world->rigid_bodies().empty() ? 0.35 * extent_ : 0.0;
  floor_ = static_cast<float>(static_cast<double>(low.y()) - floor_gap);
}

render::Picture Recorder::picture() const {
  const scenes::PhysicsWorld& world = *scene_.world;
  render::Picture picture;
  std::size_t i = 0;
  for (const auto& body : world.bodies()) {
    add_soft(*body, palette[i++ % std::size(palette)], static_cast<float>(0.012 * extent_),
             picture);
  }
  for (const scenes::RigidBody& rigid : world.rigid_bodies()) add_rigid(rigid, picture);
  for (const scenes::Intersection& intersection :
       scenes::find_intersections(scenes::read_surface(world), scenes::read_positions(world))) {
    picture.marks.push_back({static_cast<float>(intersection.point[0]),
                             static_cast<float>(intersection.point[1]),
                             static_cast<float>(intersection.point[2])});
  }
  picture.mark_radius = static_cast<float>(0.006 * extent_);
  picture.floor = floor_;
  return picture;
}

void Recorder::add(int step) {
  const render::Image image = render::draw(picture(), camera_, width_, height_, samples_);
  char name[32];
  std::snprintf(name, sizeof(name), "%05d.png", step);
  render::write_png(folder_ / name, image);
  film_.add(image);
}

void Recorder::finish() { film_.write(folder_ / "film.webp"); }

}  // namespace lazyccd::program
