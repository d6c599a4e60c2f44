// The functions that the page calls: page/demo.js.
#include <cstdint>

#include "demo.h"
#include "hash.h"

#define EXPORT(name) __attribute__((export_name(#name)))

using namespace lazyccd;
using web::Demo;

extern "C" {

/// Scenes have the order of page_scenes(). Without LazyCCD: Bullet alone.
EXPORT(demo_new) Demo* demo_new(int scene, int with_lazyccd, double speed, double size) {
  return new Demo(web::page_scenes()[static_cast<std::size_t>(scene)],
                  with_lazyccd ? scenes::Collisions::lazyccd : scenes::Collisions::bullet, speed,
                  size);
}
EXPORT(demo_delete) void demo_delete(Demo* demo) { delete demo; }
EXPORT(demo_speed) double demo_speed(int scene) {
  return web::page_scenes()[static_cast<std::size_t>(scene)].speed;
}
EXPORT(demo_margin) double demo_margin(Demo* demo) { return demo->world().options().margin; }
EXPORT(demo_step) void demo_step(Demo* demo) { demo->step(); }
EXPORT(demo_count) double demo_count(Demo* demo) { return static_cast<double>(demo->count()); }
EXPORT(demo_is_finite) int demo_is_finite(Demo* demo) { return demo->is_finite(); }

EXPORT(demo_hash) std::uint32_t demo_hash(Demo* demo) { return web::hash_of_positions(*demo); }

EXPORT(demo_draw) void demo_draw(Demo* demo) { demo->draw(); }
EXPORT(demo_bodies) int demo_bodies(Demo* demo) { return static_cast<int>(demo->drawn().size()); }
EXPORT(demo_is_soft) int demo_is_soft(Demo* demo, int body) {
  return demo->drawn()[static_cast<std::size_t>(body)].is_soft;
}
EXPORT(demo_vertex_count) int demo_vertex_count(Demo* demo, int body) {
  return static_cast<int>(demo->drawn()[static_cast<std::size_t>(body)].positions.size() / 3);
}
EXPORT(demo_positions) const float* demo_positions(Demo* demo, int body) {
  return demo->drawn()[static_cast<std::size_t>(body)].positions.data();
}
EXPORT(demo_face_count) int demo_face_count(Demo* demo, int body) {
  return static_cast<int>(demo->drawn()[static_cast<std::size_t>(body)].faces.size() / 3);
}
EXPORT(demo_faces) const std::int32_t* demo_faces(Demo* demo, int body) {
  return demo->drawn()[static_cast<std::size_t>(body)].faces.data();
}
/// The number of lines; their points follow from demo_contact_points().
EXPORT(demo_contacts) int demo_contacts(Demo* demo) {
  return static_cast<int>(demo->contact_lines().size() / 6);
}
EXPORT(demo_contact_points) const float* demo_contact_points(Demo* demo) {
  return demo->contact_lines().data();
}

EXPORT(demo_grab) void demo_grab(Demo* demo, int body, int node) { demo->grab(body, node); }
EXPORT(demo_drag) void demo_drag(Demo* demo, double x, double y, double z) {
  demo->drag(
      btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z)));
}
EXPORT(demo_let_go) void demo_let_go(Demo* demo) { demo->let_go(); }

}  // extern "C"
