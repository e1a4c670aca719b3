#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame_values.h"
#include "core/simulation.h"
#include "server/session/command.h"
#include "server/session/frame.h"
#include "server/session/processor_time.h"
#include "server/session/scheduler.h"
#include "server/session/snapshot.h"
#include "server/session/stats.h"

namespace weft {

// A session's simulation, slice by slice: what it has cost, and which entries of the log it
// follows from. Not thread-safe.
class Timeline {
 public:
  Timeline(Simulation given, std::int64_t max_frame_work,
           std::chrono::duration<double> snapshot_after);

  Simulation simulation;
  std::int64_t entries = 0;  // of the log, carried out

  // Computes a slice of a frame, which is shorter where something else waits for a thread.
  FramePart advance(Scheduler& scheduler);
  // Counts the frame that is done.
  void count_frame(Stats& stats);
  Judgement judge() const;
  // Takes back the frame under way; false where it cannot be.
  [[nodiscard]] bool drop_frame();
  // with_stats: somebody who waits for it wants its energy and strain, which else are computed when
  // somebody asks.
  std::shared_ptr<const Frame> make_frame(std::vector<Repair> repairs, bool with_stats) const;
  // Those of the present frame.
  std::vector<Repair> repairs_of_frame() const;

  // What is not needed for a while without frames.
  void release_memory();

  // Whether a restart would compute, or repeat, so much that a snapshot is due.
  bool snapshot_due() const;
  bool log_grew() const;
  void note_snapshot();
  // Goes on from there; false, and nothing done, where it is none of this scene.
  [[nodiscard]] bool begin_at(const SessionSnapshot& snapshot);

 private:
  using Duration = std::chrono::duration<double>;
  const Duration snapshot_after_;
  Duration work_{};                       // since the last snapshot
  Duration frame_work_{};                 // of the frame under way
  Duration frame_processor_{};            // the same, of the processor
  std::int64_t entries_in_snapshot_ = 0;  // the last one
  Duration processor_{};                  // of all frames, without that of threads that helped
  std::shared_ptr<HelpedTime> helped_ = std::make_shared<HelpedTime>(0);
  std::int64_t substeps_ = 0;          // of all frames
  std::shared_ptr<FrameMeter> meter_;  // of all frames
};

}  // namespace weft
