#include "random/random_options.h"

#include "random/random_source.h"

namespace lazyccd::test {

bullet::SolverOptions strict_options() {
  bullet::SolverOptions options;
  options.jump_speed = 1e30;
  options.untangling_speed = 0;
  options.measure_energy = true;
  return options;
}

bullet::SolverOptions random_options(std::uint32_t number) {
  RandomSource random(number);
  bullet::SolverOptions options = strict_options();
  if (random.chance(0.4)) options.solver_iterations = 1;
  if (random.chance(0.4)) options.max_impulse_rounds = random.below(3);
  if (random.chance(0.4)) options.max_zone_rounds = random.below(2);
  if (random.chance(0.4))
    options.thickness = random.chance(0.5) ? 0 : random.across_scales(1e-5, 0.1);
  if (random.chance(0.4)) options.position_correction = random.below(2);
  if (random.chance(0.4)) options.friction = false;
  if (random.chance(0.4)) options.restitution = 1;
  if (random.chance(0.4)) options.replace_rigid_contacts = false;
  if (random.chance(0.4)) options.rest_speed = 0;
  if (random.chance(0.4)) options.untangling_speed = random.across_scales(0.01, 10);
  options.coulomb_friction = random.chance(0.4);
  return options;
}

}  // namespace lazyccd::test
