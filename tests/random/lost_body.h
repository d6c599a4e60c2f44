// A scene of the library with one soft body more, which gets lost. Nothing else should notice.
#pragma once

#include <string>
#include <vector>

#include "scenes/scene.h"

namespace lazyccd::test {

/// How the additional body gets lost.
enum class Loss {
  falls,         ///< it begins to fall beside everything else
  fell_minutes,  ///< it has been falling for three minutes
  not_finite,    ///< a position and a velocity become NaN
  inverted,      ///< its tetrahedra are inverted from the start, and a force acts on them
  explodes,      ///< its pressure, or its stiffness, is more than a step can integrate
};
inline constexpr Loss all_losses[] = {Loss::falls, Loss::fell_minutes, Loss::not_finite,
                                      Loss::inverted, Loss::explodes};
const char* name_of(Loss loss);

struct LostBodyReport {
  bool is_same = false;  ///< all others end as they do without the body, to the bit
  double farthest = 0;   ///< largest difference of a coordinate of the others, metres
  double thickness = 0;  ///< that contacts of the scene keep, metres
  double ms_per_step = 0, ms_per_step_without = 0;
  std::string status;  ///< of LazyCCD
};

/// Where all bodies of the scene are after its last step, or null if `loss` makes no difference in
/// this world: the coordinates of nodes and of origins of rigid bodies.
LostBodyReport run_with_lost_body(const scenes::SceneInfo& info,
                                  const scenes::Parameters& parameters, Loss loss);

}  // namespace lazyccd::test
