#pragma once

#include "core/motion/guard.h"

namespace weft {

// Whether a sheet hardly moved in a frame: kinetic energy and net forces, contact included, were
// small. Forces as means over the frame, for those of one step are as rough as positions are
// rounded, and as root mean square over the sheet, for single particles of stiff, light sheets
// chatter for ever. height: of the sheet, m. by_frame: energy of what moved from frame to frame
// alone, for what cloth presses into a collider, or cloth, is led out again in every step, at any
// speed; a force that lasts shows in the frames to come.
bool is_quiet(const Mesh& mesh, const VectorXd& inverse_mass, const Drive& drive, double height,
              const SheetState& before, const SheetState& after, bool by_frame = false);

// Counts quiet frames in a row.
class Rest {
 public:
  bool at_rest() const { return frames_ >= kFrames; }
  int frames() const { return frames_; }
  void add_frame(bool quiet) { frames_ = quiet ? frames_ + 1 : 0; }
  void settle() { frames_ = kFrames; }
  // Something was changed.
  void disturb() { frames_ = 0; }
  void adopt(int frames) { frames_ = frames; }

 private:
  static constexpr int kFrames = 30;
  int frames_ = 0;
};

}  // namespace weft
