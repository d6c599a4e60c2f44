// Ray casts against a picture's surfaces, by Embree.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <Eigen/Core>
#include <memory>

#include "render/picture.h"

namespace lazyccd::render {

using Eigen::Vector3f;

/// Where a ray meets a surface.
struct Hit {
  Vector3f point, normal;  // the normal has unit length and points against the ray
  Colour colour;
  bool glows = false;  // a mark
};

/// The surfaces of one picture, which must outlive it.
class Tracer {
 public:
  /// Throws std::runtime_error if Embree does not start.
  explicit Tracer(const Picture& picture);

  /// Finds the first surface along a ray. Returns false if there is none.
  bool hit(const Vector3f& origin, const Vector3f& direction, Hit& found) const;
  /// Returns true if any surface is on the ray.
  bool blocked(const Vector3f& origin, const Vector3f& direction) const;

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  void add_mesh(const Mesh& mesh);
  void add_rope(const Rope& rope);
  void add_marks();
  void attach(RTCGeometry geometry);

  const Picture& picture_;
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
  std::vector<std::vector<Vector3f>> normals_;  // by mesh: three for each face, one a corner
};

}  // namespace lazyccd::render
