#include "scenes/behaviour/bodies.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <random>

#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "scenes/meshes/solid.h"

namespace lazyccd::scenes::behaviour {
namespace {

std::unique_ptr<btSoftBody> make_sphere_surface(Application& application, const btVector3& centre,
                                                double radius) {
  constexpr int nodes = 256;
  const btScalar r = scalar(radius);
  return std::unique_ptr<btSoftBody>(
      btSoftBodyHelpers::CreateEllipsoid(application.info(), centre, btVector3(r, r, r), nodes));
}

// Halfway between a cube and its ball, because tetrahedra at the edges of a cube become flat in a
// ball.
std::unique_ptr<btSoftBody> make_rounded(Application& application, const Ball& ball) {
  constexpr int cells = 4;
  return make_solid(application.info(), cells, ball.mass, [&](double u, double v, double w) {
    const btVector3 cube = vector(2 * u - 1, 2 * v - 1, 2 * w - 1);
    const double shell = static_cast<double>(cube.absolute()[cube.absolute().maxAxis()]);
    const double length = static_cast<double>(cube.length());
    const double round = length > 0 ? 0.5 + 0.5 * shell / length : 0;
    return ball.centre + scalar(ball.radius * round) * cube;
  });
}

}  // namespace

std::unique_ptr<btSoftBody> make(Application& application, const Cloth& cloth) {
  std::mt19937 random(1);
  Sheet sheet{cloth.nodes, cloth.nodes, cloth.width, cloth.width};
  sheet.height = cloth.height;
  sheet.angle = cloth.angle;
  sheet.jitter = 0.002;
  sheet.mass = cloth.mass;
  return make_sheet(application.info(), sheet, random);
}

btSoftBody* add(Application& application, const Cloth& cloth) {
  return application.add(make(application, cloth), 0.01, cloth.stiffness);
}

btSoftBody* add(Application& application, const Ball& ball) {
  if (!application.is_rigid()) {
    auto body = make_rounded(application, ball);
    body->m_cfg.kDF = scalar(ball.friction);
    return application.add_solid(std::move(body), ball.modulus);
  }
  auto body = make_sphere_surface(application, ball.centre, ball.radius);
  body->setTotalMass(scalar(ball.mass), true);
  body->m_cfg.kPR = scalar(ball.pressure);
  body->m_cfg.kDF = scalar(ball.friction);
  return application.add(std::move(body));
}

btSoftBody* add_shell(Application& application, const btVector3& centre, double radius) {
  auto body = make_sphere_surface(application, centre, radius);
  body->setTotalMass(scalar(0.5), true);
  body->m_cfg.kMT = scalar(0.1);
  body->setPose(false, true);
  return application.add(std::move(body));
}

void add_ground(Application& application) {
  constexpr double friction = 1;
  application.add(make_box(10, 0.4, 10), at(0, -0.2, 0), 0, friction);
}

}  // namespace lazyccd::scenes::behaviour
