#include "random/random_options.h"

#include "random/random.h"

namespace lazyccd::test {

bullet::Options random_options(std::uint32_t number) {
  Dice dice(number);
  bullet::Options options;
  if (dice.chance(0.4)) options.sweeps = 1;
  if (dice.chance(0.4)) options.max_iterations = dice.below(3);
  if (dice.chance(0.4)) options.max_zones = dice.below(2);
  if (dice.chance(0.4)) options.thickness = dice.chance(0.5) ? 0 : dice.across_scales(1e-5, 0.1);
  if (dice.chance(0.4)) options.recovery = dice.below(2);
  if (dice.chance(0.4)) options.friction = false;
  if (dice.chance(0.4)) options.restitution = 1;
  if (dice.chance(0.4)) options.rigid_contacts = false;
  if (dice.chance(0.4)) options.rest_speed = 0;
  if (dice.chance(0.4)) options.untangling_speed = dice.across_scales(0.01, 10);
  return options;
}

}  // namespace lazyccd::test
