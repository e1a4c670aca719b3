#pragma once

#include <limits>
#include <optional>

namespace weft {

// What moved in a frame, of free particles.
struct MeanMotion {
  double energy = 0;        // of the mean velocities, J
  double acceleration = 0;  // that they come to from standing, root mean square over gravity
};

// A scene on its shortest way to rest, in plain values: it moves by its own forces, and all stands
// still whenever its motion has begun to slow down. (Kinetic damping: P. A. Cundall 1976; M. R.
// Barnes, Form finding and analysis of tension structures by dynamic relaxation, 1999.) What is
// left of forces is seen in frames that begin standing, as means over the frame for the reason that
// core/motion/rest.h gives.
struct Relaxation {
  enum class Next { kMoveOn, kStandStill, kRest };

  bool begun = false;
  bool ended = false;                                      // at rest
  bool standing = true;                                    // at the begin of the frame to come
  double energy = 0;                                       // of the last frame since it stood, J
  std::optional<double> residual;                          // RMS of net forces over weights
  double least = std::numeric_limits<double>::infinity();  // residual so far
  int stalls = 0;  // frames from standing without a smaller one

  // Frames to come that stand still in parts: what the way from fewer particles has stretched would
  // throw the cloth about.
  int settling = 0;

  bool operator==(const Relaxation&) const = default;

  // What follows from a frame. quiet: whether it was, see is_quiet(); a scene that chatters rests
  // where it is, once its forces get no smaller.
  Next look(const MeanMotion& motion, bool quiet);
};

// At which a scene has come to rest by relaxation, of its weight.
inline constexpr double kRestResidual = 1e-3;

}  // namespace weft
