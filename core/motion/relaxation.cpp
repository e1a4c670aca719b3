#include "core/motion/relaxation.h"

namespace weft {

Relaxation::Next Relaxation::look(const MeanMotion& motion, bool quiet) {
  if (settling > 0) {
    --settling;
    return Next::kStandStill;
  }
  constexpr int kStalls = 16;
  constexpr double kSmaller = 0.9;
  if (standing) {
    residual = motion.acceleration;
    if (*residual < kSmaller * least) {
      least = *residual;
      stalls = 0;
    } else {
      ++stalls;
    }
    if (*residual <= kRestResidual || (quiet && stalls >= kStalls)) {
      ended = true;
      return Next::kRest;
    }
  }
  standing = motion.energy < energy;
  energy = standing ? 0 : motion.energy;
  return standing ? Next::kStandStill : Next::kMoveOn;
}

}  // namespace weft
