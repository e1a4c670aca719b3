#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/frame_values.h"
#include "core/simulation.h"
#include "server/session/history_budget.h"

namespace weft {

// Something made of a frame, such as its bytes on the wire.
struct Encoding {
  std::shared_ptr<const void> data;
  std::size_t bytes = 0;
};

// Encodings of one frame: each made once for all watchers, and gone with the frame.
class EncodingCache {
 public:
  // The encoding of `key`, made by the first who asks; whoever asks meanwhile waits for it.
  std::shared_ptr<const void> get(const std::string& key,
                                  const std::function<Encoding()>& make) const;

  // Counts the bytes of every encoding, those to come too, in `meter`; nullptr: nowhere any more.
  void count_in(std::shared_ptr<ByteMeter> meter) const;

 private:
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::shared_ptr<const void>> encodings_;
  mutable std::size_t bytes_ = 0;
  mutable std::shared_ptr<ByteMeter> meter_;
};

// The state of a session at one time. Never changes once it is published.
struct Frame {
  std::int64_t number = 0;
  double time = 0;  // s
  // Of particles that are simulated, and not interpolated; so is what follows.
  std::vector<double> positions;           // (3 x particles) planes x, y, z, m
  std::vector<double> velocities;          // (3 x particles) planes x, y, z, m/s
  double kinetic_energy = 0;               // J
  std::optional<std::int64_t> cloth_cuts;  // of scenes with cloth contact
  bool at_rest = false;
  std::optional<double> residual;  // of scenes that relax, of their weight
  std::vector<double> pose_times;  // of colliders with poses, s; empty: all at `time`
  std::int64_t substeps = 0;       // since the frame before
  double substep = 0;              // s
  std::vector<Repair> repairs;     // that it took
  // What the values below are read with: the scene as it was, and what reads them. Where there is
  // none they were recorded, or not.
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<FrameMeter> meter;
  std::optional<Deformation> deformation;  // absent: nobody wanted it when the frame was made
  std::vector<double> pressures;           // (particles) Pa
  std::vector<double> clearances;          // (particles) m
  EncodingCache encodings;

  std::size_t bytes() const {  // without encodings
    return sizeof(Frame) + (positions.size() + velocities.size()) * sizeof(double);
  }
};

// As they came with the frame, or computed now.
Deformation deformation_of(const Frame& frame);
std::vector<double> pressures_of(const Frame& frame);
// shown: positions of all particles that are shown, planes x, y, z, m.
std::vector<double> clearances_of(const Frame& frame, const std::vector<double>& shown);

}  // namespace weft
