#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/frame_values.h"
#include "core/model/mesh.h"
#include "core/model/scene.h"
#include "core/motion/thread_pool.h"
#include "core/plan.h"
#include "core/sheet_factory.h"
#include "core/snapshot.h"
#include "core/verdict.h"

namespace weft {

struct FrameStats : Deformation {
  double kinetic_energy = 0;                    // J
  std::optional<std::int64_t> cloth_cuts = {};  // of scenes with cloth contact
};

// What became of a frame that is computed in parts.
enum class FramePart { kDone, kUnfinished, kFailed };
// Whether a part is long enough.
using Enough = std::function<bool()>;

// A scene in motion. Not thread-safe; equal scenes and calls give equal bits.
class Simulation {
 public:
  // Precondition: find_problems(scene) is empty.
  explicit Simulation(Scene scene);
  Simulation(Scene scene, SolverFactory make_solver);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  const Scene& scene() const;
  const Plan& plan() const;
  // Set when the planned or asked step must not be run; advance_frame() is then not called.
  std::optional<StepRefusal> refusal() const;
  // What a frame may cost, in particles times substeps, beside kMaxSubsteps: neither a plan nor a
  // repair exceeds it. No limit by default.
  void limit_frame_work(std::int64_t most);

  // Advances by one frame step. A frame that the guard does not trust (core/motion/guard.h) is
  // computed again from the one before it with half the step; where both attempts agree, the motion
  // is real and the step stays. After scene().solver.max_repairs repairs it returns false for good,
  // with the state of the last good frame. A scene at rest, without wind, sleeps: the frame repeats
  // without a substep until a textile or what holds it changes. The pool shares large sheets;
  // frames do not depend on it.
  [[nodiscard]] bool advance_frame(ThreadPool& pool = calling_thread());
  // The same in parts: asks between substeps, and stops where it is enough. As long as the frame is
  // unfinished, positions, velocities and textiles are undefined, and nothing may be changed.
  [[nodiscard]] FramePart advance_frame(const Enough& enough, ThreadPool& pool = calling_thread());
  // Of the substeps of an unfinished frame, with the step that it has now; 0 where there is none.
  double frame_share() const;
  // Takes an unfinished frame back: all is as it was before, to the bit. False, and nothing done,
  // where there is none, or where it is so short that it was not worth saving what was before it.
  [[nodiscard]] bool drop_frame();
  // More than these have nothing to do in a pool.
  int most_threads() const;
  // Lets go of what its scene and the motion are enough to make again, until the next call that
  // needs it, which then takes longer: for a while without frames. Changes nothing else.
  void release_memory();
  // All so far.
  const std::vector<Repair>& repairs() const;
  // Why advance_frame() returned false.
  const std::string& failure() const;
  // Substeps that the last frame took.
  std::int64_t substeps() const;

  std::int64_t frame() const;
  double time() const;   // s
  bool at_rest() const;  // for 30 frames, see Session.at_rest in the interface
  bool asleep() const;   // at rest, and nothing will wake it but a change
  // While it relaxes, and at the rest it came to: the net forces over weights, root mean square
  // over free particles, when it last began to move from standing.
  std::optional<double> residual() const;
  int particle_count() const;  // of all sheets

  // Planes x, y, z of all sheets in scene order; out has 3 x particle_count values.
  void copy_positions(std::span<double> out) const;   // m
  void copy_velocities(std::span<double> out) const;  // m/s
  double kinetic_energy() const;                      // J
  std::optional<std::int64_t> cloth_cuts() const;
  Deformation deformation() const;
  FrameStats stats() const;
  // How the sheets sit, which takes about as long as some substeps.
  Verdict verdict() const;
  // The scene with the textiles, pins and paths of the last frame, without a start that nothing
  // depends on any more; the same until they change.
  std::shared_ptr<const Scene> scene_of_frame() const;
  // What colliders press each particle of a sheet with, Pa, see core/frame_values.h.
  VectorXd pressures(std::size_t sheet) const;

  // Changes the textile of a sheet between frames: positions and velocities stay, the step is
  // planned anew. Over `duration`, s, the textile changes with every frame, from what it is now, in
  // the next one for the first time; a change under way ends with its present values. Changes
  // nothing and returns the refusal when the step for the textile must not be run. Steps that both
  // ends bear, all between them do: stiffness, damping and mass are linear in a textile's values.
  // Precondition: find_problems(textile, "") is empty; index < scene().sheets.size(); with a
  // duration both textiles are measured, or both raw.
  std::optional<StepRefusal> set_textile(std::size_t index, const Textile& textile,
                                         double duration = 0);
  // The textile that a sheet has, or that its textile changes to.
  const Textile& target_textile(std::size_t index) const;
  // Whether the last frame's textile was another than that of the frame before it, over a duration.
  bool textile_changed() const;

  // What holds particles and moves colliders now.
  Constraints constraints() const;
  // What is wrong with actions, see apply().
  std::vector<Problem> problems_of(const std::vector<Action>& actions) const;
  // Does all of them between two frames, at time(). Particles that are let go keep their velocity.
  // Where pins come or go the step is planned anew: then as set_textile(). Precondition:
  // problems_of(actions) is empty.
  std::optional<StepRefusal> act(const std::vector<Action>& actions);

  // Precondition: advance_frame() has not failed, and no frame is unfinished.
  Snapshot snapshot() const;
  // Goes on from there: later frames are equal to the bit to those of the simulation that the
  // snapshot was taken of. False, and nothing changed, where it is none of this scene, whatever its
  // textiles are.
  [[nodiscard]] bool restore(const Snapshot& snapshot);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace weft
