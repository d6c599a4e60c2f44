#include "render/tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace lazyccd::render {
namespace {

Vector3f vector(const Point& p) { return {p[0], p[1], p[2]}; }

// Returns the normal of each corner of each face: the mean, weighted by area, over the faces at
// that vertex whose angle to this face is at most mesh.crease.
std::vector<Vector3f> corner_normals(const Mesh& mesh) {
  std::vector<Vector3f> flat;
  std::vector<std::vector<std::size_t>> faces_of(mesh.vertices.size());
  for (const Face& face : mesh.faces) {
    const Vector3f a = vector(mesh.vertices[face[0]]);
    for (const std::int32_t v : face) faces_of[v].push_back(flat.size());
    flat.push_back((vector(mesh.vertices[face[1]]) - a).cross(vector(mesh.vertices[face[2]]) - a));
  }
  const float limit = mesh.crease < 3.15f ? std::cos(mesh.crease) : -2.0f;
  std::vector<Vector3f> normals;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const std::int32_t v : mesh.faces[f]) {
      Vector3f sum = Vector3f::Zero();
      for (const std::size_t other : faces_of[v]) {
        if (flat[f].dot(flat[other]) >= limit * flat[f].norm() * flat[other].norm()) {
          sum += flat[other];
        }
      }
      normals.push_back(sum.norm() > 0 ? sum : flat[f]);
    }
  }
  for (Vector3f& normal : normals) normal.normalize();
  return normals;
}

RTCRay ray(const Vector3f& origin, const Vector3f& direction) {
  RTCRay r{};
  r.org_x = origin[0], r.org_y = origin[1], r.org_z = origin[2];
  r.dir_x = direction[0], r.dir_y = direction[1], r.dir_z = direction[2];
  r.tfar = std::numeric_limits<float>::infinity();
  r.mask = ~0u;
  return r;
}

// Allocates points with a radius (x, y, z, r), as Embree's curves and spheres need them.
float* set_points(RTCGeometry geometry, std::size_t count) {
  return static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                     RTC_FORMAT_FLOAT4, 4 * sizeof(float), count));
}

}  // namespace

Tracer::Tracer(const Picture& picture) : picture_(picture), device_(rtcNewDevice(nullptr)) {
  if (!device_) throw std::runtime_error("Embree could not start on this machine");
  scene_.reset(rtcNewScene(device_.get()));
  for (const Mesh& mesh : picture.meshes) add_mesh(mesh);
  for (const Rope& rope : picture.ropes) add_rope(rope);
  if (!picture.marks.empty()) add_marks();
  rtcCommitScene(scene_.get());
}

void Tracer::attach(RTCGeometry geometry) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
}

void Tracer::add_mesh(const Mesh& mesh) {
  const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                             RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                             mesh.vertices.size()));
  for (const Point& p : mesh.vertices) points = std::copy(p.begin(), p.end(), points);
  auto* corners = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), mesh.faces.size()));
  for (const Face& face : mesh.faces) corners = std::copy(face.begin(), face.end(), corners);
  attach(geometry);
  normals_.push_back(corner_normals(mesh));
}

void Tracer::add_rope(const Rope& rope) {
  const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
  float* points = set_points(geometry, 2 * rope.links.size());
  auto* starts = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, sizeof(unsigned), rope.links.size()));
  unsigned start = 0;
  for (const Edge& link : rope.links) {
    for (const std::int32_t v : link) {
      points = std::copy(rope.points[v].begin(), rope.points[v].end(), points);
      *points++ = rope.radius;
    }
    *starts++ = start;
    start += 2;
  }
  attach(geometry);
}

void Tracer::add_marks() {
  const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_SPHERE_POINT);
  float* points = set_points(geometry, picture_.marks.size());
  for (const Point& p : picture_.marks) {
    points = std::copy(p.begin(), p.end(), points);
    *points++ = picture_.mark_radius;
  }
  attach(geometry);
}

bool Tracer::hit(const Vector3f& origin, const Vector3f& direction, Hit& found) const {
  RTCRayHit query{};
  query.ray = ray(origin, direction);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(scene_.get(), &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_.get(), &context, &query);
#endif
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  found.point = origin + query.ray.tfar * direction;
  const Vector3f flat = Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  const bool faces_us = flat.dot(direction) < 0;
  found.normal = faces_us ? flat : Vector3f(-flat);
  found.glows = false;
  const std::size_t id = query.hit.geomID;
  if (id < picture_.meshes.size()) {
    const Mesh& mesh = picture_.meshes[id];
    found.colour = faces_us ? mesh.front : mesh.back;
    const Vector3f* corner = &normals_[id][3 * static_cast<std::size_t>(query.hit.primID)];
    const float u = query.hit.u, v = query.hit.v;
    const Vector3f smooth =
        ((1 - u - v) * corner[0] + u * corner[1] + v * corner[2]) * (faces_us ? 1.0f : -1.0f);
    if (smooth.norm() > 0.1f) found.normal = smooth.normalized();
  } else if (id < picture_.meshes.size() + picture_.ropes.size()) {
    found.colour = picture_.ropes[id - picture_.meshes.size()].colour;
  } else {
    found.glows = true;
  }
  return true;
}

bool Tracer::blocked(const Vector3f& origin, const Vector3f& direction) const {
  RTCRay r = ray(origin, direction);
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(scene_.get(), &r);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_.get(), &context, &r);
#endif
  return r.tfar < 0;
}

}  // namespace lazyccd::render
