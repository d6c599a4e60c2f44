// Embree behind the few calls that pictures need.
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

struct Hit {
  Vector3f point, normal;  // of unit length, towards where the ray came from
  Colour colour;
  bool glows = false;
};

class Tracer {
 public:
  explicit Tracer(const Picture& picture);

  // The first surface on the way; false where there is none.
  bool hit(const Vector3f& origin, const Vector3f& direction, Hit& found) const;
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
  std::vector<std::vector<Vector3f>> normals_;  // by mesh: of the three corners of each face
};

}  // namespace lazyccd::render
