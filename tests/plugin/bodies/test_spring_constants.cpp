// The constants that are read off a mass-spring force are those that it was made with.
#include "bodies/spring_constants.h"
#include "support/catch.h"

using namespace lazyccd;

TEST_CASE("constants of a mass-spring force are read off the forces of two springs") {
  const bool along_spring = GENERATE(false, true);
  const double damping = GENERATE(0.0, 0.1, 3.7e-5, 41.0);
  CAPTURE(along_spring, damping);
  const btDeformableMassSpringForce force(7, static_cast<btScalar>(damping), along_spring);
  const bullet::SpringConstants read = bullet::SpringProbe().read(force);
  CHECK(read.damping == static_cast<btScalar>(damping));
  CHECK(read.along_spring == along_spring);
}
