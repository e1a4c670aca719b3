#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "core/simulation.h"
#include "server/session/request.h"

// What can be asked of a session between two frames, and how it answers.
namespace weft {

// Why a command was not carried out.
struct Refusal {
  enum class Why {
    kDeleted,           // the session is gone
    kDraining,          // the server is going
    kEvicted,           // another server has the session, or the store alone
    kBusy,              // too many commands wait
    kRunning,           // stepping needs a paused session
    kFailed,            // the solver diverged
    kStale,             // expected_frame is not the newest frame
    kNotAhead,          // until_frame is not past the newest frame
    kInterrupted,       // the step was paused
    kCancelled,         // the caller went away
    kInvalid,           // see problems
    kUnstable,          // see step, and text for the field to blame
    kRequestUsed,       // the request's id was given to another call
    kNotKept,           // its log cannot be written, see text
    kSnapshotExists,    // there is a snapshot of that name, see text
    kTooManySnapshots,  // of the session
  };
  Why why;
  std::int64_t frame = 0;  // newest frame
  std::vector<Problem> problems;
  StepRefusal step;
  std::string text;
};

// How the sheets sit in the newest frame, and what it took to come there since this process has the
// session.
struct Judgement {
  Verdict verdict;
  std::int64_t substeps = 0;
  double seconds = 0;  // of processors, of all threads together
};

// How a session stood when a command had been carried out.
struct Applied {
  std::int64_t frame = 0;   // first frame in which it shows
  std::int64_t newest = 0;  // frame
  double time = 0;          // of the newest, s
  bool at_rest = false;     // the newest
  Textile textile;          // of SetTextile
  std::shared_ptr<const Plan> plan;
  std::shared_ptr<const Judgement> judgement = {};  // of Judge
};

using Outcome = std::variant<Applied, Refusal>;

// Called exactly once, from any thread, with no lock held. Must not block.
using Done = std::function<void(const Outcome&)>;

// Computes frames; refused while running. Stops at the next frame once `cancelled`.
struct StepCommand {
  std::int64_t frames = 1;
  std::optional<std::int64_t> expected_frame;
  std::stop_token cancelled;
  Request request;
  Done done;
};

// Advances until paused, or until a goal is met. Replaces pace and goal of a run under way.
struct RunCommand {
  std::optional<double> time_scale;  // simulated s per s; absent: as fast as possible
  std::optional<std::int64_t> until_frame;
  bool until_rest = false;
  Request request;
  Done done;
};

// Ends a run, and steps under way.
struct PauseCommand {
  Request request;
  Done done;
};

// What becomes of a textile, or why it cannot.
using TextileEdit = std::function<std::variant<Textile, std::vector<Problem>>(const Textile&)>;

// Changes the textile of a sheet; `edit` begins with the one that it has or changes to.
// Precondition: the sheet exists; find_problems has nothing to say of what `edit` answers, and
// Simulation::set_textile() can have it.
struct SetTextile {
  std::size_t sheet = 0;
  TextileEdit edit;
  double duration = 0;  // s
  Request request;
  Done done;
};

// Handles the scene: all of the actions or none.
struct Act {
  std::vector<Action> actions;
  Request request;
  Done done;
};

// Keeps the session as it is, under an id; empty: default_snapshot_id() of its newest frame.
struct KeepSnapshot {
  std::string id;
  Request request;
  Done done;
};

// Judges how the sheets sit, see Simulation::verdict().
struct Judge {
  Request request;
  Done done;
};

using Command =
    std::variant<StepCommand, RunCommand, PauseCommand, SetTextile, Act, KeepSnapshot, Judge>;

}  // namespace weft
