#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/box_edges.h"
#include "core/cloth_contact/cloth_contact.h"
#include "core/contact/moving_bodies.h"
#include "core/model/actions.h"
#include "core/motion/relaxation.h"
#include "core/motion/rest.h"
#include "core/moving_sheet.h"
#include "core/open_seams.h"
#include "core/repairs.h"
#include "core/simulation.h"

// What simulation.cpp (frames), simulation_changes.cpp (textiles, grips and pins) and
// simulation_snapshot.cpp share; for nobody else.
namespace weft {

// Sheets at the end of the frame that is being computed.
using NextStates = std::vector<SheetState>;

// Positions and velocities of all sheets, to begin again with other forces or another step.
struct SheetStates {
  std::vector<Matrix3Xd> x, v;
};

// A frame that is being computed.
struct UnfinishedFrame {
  std::int64_t substeps = 0;            // taken by this attempt
  std::unique_ptr<Simulation> coarser;  // that comes to rest before
  std::optional<Snapshot> before;       // where it can be dropped
  double energy = 0;                    // when it last settled, J
};

struct Simulation::State {
  Scene scene;
  std::shared_ptr<const Scene> scene_of_frame;  // a copy, once it is asked for
  SolverFactory make_solver;
  Plan plan;
  std::vector<MovingSheet> sheets;
  std::optional<ClothContact> cloth_contact;
  std::vector<OpenSeams> open_seams;  // of each sheet, while they close
  std::vector<BoxEdges> box_edges;    // of each sheet, with cloth contact where there are boxes
  MovingBodies bodies;
  std::vector<Grip> grips;  // their pins are among the scene's
  std::int64_t frame = 0;
  std::int64_t substeps = 0;  // of the last frame
  double rest_after = 0;      // s
  Repairs repairs;
  Rest rest;
  std::optional<Relaxation> relaxation;
  bool textile_changed = false;
  std::string failure;
  std::optional<UnfinishedFrame> unfinished;
  bool released = false;  // what follows from the scene, see Simulation::release_memory()

  State(Scene given, SolverFactory factory);
  double time() const { return static_cast<double>(frame) * scene.solver.frame_step; }
  int particle_count() const;
  LeftOut at_open_seams() const;
  void make_cloth_contact();
  Contacts contacts_of(std::size_t sheet, double time, double dt, double pressed = 0) const;
  void release_memory();
  void restore_memory();
  SheetDefinition simulated(std::size_t sheet) const;
  VectorXd planned_inverse_mass(std::size_t sheet) const;
  Plan plan_for(const std::vector<Matrix3Xd>& x) const;
  Plan plan_now() const;
  std::optional<StepRefusal> refusal_of(const StepPlan& step) const;

  // frames
  FramePart advance_frame(const Enough& enough, ThreadPool& pool);
  bool begin_frame(bool in_parts, ThreadPool& pool);
  bool take_substeps(const Enough& enough, ThreadPool& pool);
  void step(double time, double dt, int slow, bool ends_frame, ThreadPool& pool);
  Attempt inspect_sheets(NextStates& next, ThreadPool& pool);
  Decision repair(const Attempt& made, NextStates& next);
  void begin_again();
  void start(std::size_t sheet, const Matrix3Xd& x, const Matrix3Xd& v, double time);
  void restart_from(NextStates& next);
  // stays: everything is where it was at the end of the last frame.
  void forget_motion(bool stays = false);
  bool keep_to_budget(NextStates& next);
  bool fail(const char* what, const std::string& reason);
  bool quiet(const NextStates& next) const;

  // relaxation
  bool begins_to_relax() const;
  std::unique_ptr<Simulation> coarser_simulation() const;
  bool relax_coarser(const Enough& enough, ThreadPool& pool);
  void stand_still(double time, NextStates& next);
  void settle(double time);
  bool is_relaxing() const;
  void set_damping(bool relaxes);
  void make_solvers();
  MeanMotion mean_motion(const NextStates& next) const;
  void relax(bool quiet, NextStates& next);

  // changes
  void put_textile(std::size_t sheet, const Textile& textile);
  std::optional<StepRefusal> set_textile(std::size_t sheet, const Textile& textile);
  bool change_textiles();
  bool change_dressing();
  void dress(const DressingState& state);
  void shorten_step();
  Constraints constraints() const;
  ActionContext action_context() const;
  void adopt(Constraints constraints);
  void disturb(bool relaxes);
  SheetStates closing_states() const;
  void restart(const SheetStates& states, double old_dt, const std::vector<bool>& changed);

  // snapshots
  Snapshot snapshot() const;
  void go_back_to(const Snapshot& before);
  bool adopt(const Snapshot& snapshot);
};

}  // namespace weft
