#include "client/script/performance.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

#include "client/recording/points.h"
#include "client/scene_file.h"
#include "client/script/observer.h"

namespace weft::client {
namespace {

using Sessions = v1::SessionService::Stub;

// The frames of all recordings that a case makes of a session.
v1::FrameFormat format_of(const Case& performed, const std::string& session) {
  v1::FrameFormat format;
  format.set_encoding(v1::FRAME_ENCODING_FLOAT32);
  for (const Step& step : performed.steps) {
    const auto* what = std::get_if<RecordStep>(&step.what);
    if (what == nullptr || what->session != session) continue;
    format.set_velocities(format.velocities() || what->velocities);
    if (what->encoding == v1::FRAME_ENCODING_FLOAT64) format.set_encoding(what->encoding);
  }
  return format;
}

double position(const Sight& sight, const Expectation& expectation) {
  for (const auto& sheet : sight.header.sheets()) {
    const ParticlePlace& place = expectation.particle;
    if (!place.sheet.empty() && sheet.name() != place.sheet) continue;
    const int particle =
        sheet.first_particle() + place.number.value_or(place.row * sheet.columns() + place.column);
    if (place.number && *place.number >= sheet.particle_count()) break;
    const Points point =
        read_points(sight.frame.positions_m(), sight.header, static_cast<std::size_t>(particle), 1);
    return (expectation.axis == 0 ? point.x : expectation.axis == 1 ? point.y : point.z)[0];
  }
  return std::numeric_limits<double>::quiet_NaN();
}

// NaN where there is none: the time of rest of a sheet in motion, cuts where they are not counted.
double value_of(const Sight& sight, const v1::Verdict& verdict, const Expectation& expectation) {
  const v1::FrameStats& stats = sight.frame.stats();
  switch (expectation.quantity) {
    case Quantity::kFrame:
      return static_cast<double>(sight.frame.number());
    case Quantity::kTime:
      return sight.frame.time_s();
    case Quantity::kAtRest:
      return stats.at_rest() ? 1 : 0;
    case Quantity::kRestTime:
      return sight.rest_time_s.value_or(std::numeric_limits<double>::quiet_NaN());
    case Quantity::kLargestStrain:
      return sight.tally.largest_strain;
    case Quantity::kStrain:
      return stats.largest_strain();
    case Quantity::kCuts:
      return stats.has_cloth_cut_count() ? static_cast<double>(stats.cloth_cut_count())
                                         : std::numeric_limits<double>::quiet_NaN();
    case Quantity::kKineticEnergy:
      return stats.kinetic_energy_j();
    case Quantity::kPotentialEnergy:
      return stats.potential_energy_j();
    case Quantity::kEnergy:
      return stats.kinetic_energy_j() + stats.potential_energy_j();
    case Quantity::kPosition:
      return position(sight, expectation);
    case Quantity::kStrainWarp:
      return verdict.strain_warp();
    case Quantity::kStrainWeft:
      return verdict.strain_weft();
    case Quantity::kPressure:
      return verdict.largest_pressure_pa();
    case Quantity::kSlid:
      return verdict.slid_m();
  }
  return std::numeric_limits<double>::quiet_NaN();
}

bool needs_verdict(const ExpectStep& step) {
  return step.faults || std::ranges::any_of(step.expectations, [](const Expectation& each) {
           return each.quantity >= Quantity::kStrainWarp;
         });
}

Finding finding_of(const Step& step, const std::set<std::string>& wanted,
                   const v1::Verdict& verdict) {
  VerdictFinding found{.faults = {}, .wanted = wanted, .text = {}};
  for (const v1::Fault& fault : verdict.faults()) {
    found.faults.insert(fault.code());
    found.text += (found.text.empty() ? "" : "; ") + fault.code() + ": " + fault.message();
  }
  const bool passed = found.faults == wanted;
  return {.line = step.line, .name = "verdict", .passed = passed, .verdict = std::move(found)};
}

class Performer {
 public:
  Performer(Connection& connection, const Case& performed, bool replace,
            const std::function<void(const std::string&)>& progress)
      : connection_(connection), case_(performed), replace_(replace), progress_(progress) {}

  CaseResult perform() {
    const auto start = std::chrono::steady_clock::now();
    result_.ended = true;
    for (const Step& step : case_.steps) {
      progress_(
          fmt::format("step {} of {}: {}", result_.steps_done + 1, case_.steps.size(), step.kind));
      const bool done = attempt(
          step, [&] { std::visit([&](const auto& what) { do_step(step, what); }, step.what); });
      if (!done) break;
      ++result_.steps_done;
    }
    const bool all_done = result_.steps_done == case_.steps.size();
    for (auto& [name, actor] : actors_) {
      if (all_done) attempt(case_.steps.back(), [this, &held = actor] { settle(held); });
      actor.observer.reset();
      remove(actor.session);
    }
    result_.wall = std::chrono::steady_clock::now() - start;
    return std::move(result_);
  }

 private:
  struct Actor {
    v1::Session session;  // as it was created
    std::unique_ptr<Observer> observer;
    std::int64_t run_from = 0;  // first frame of its last run
    bool running = false;

    // Whether the last run is over, and all of it seen.
    bool stands(const Sight& sight) const {
      return sight.tally.frames > 0 && sight.progress.state() != v1::SESSION_STATE_RUNNING &&
             sight.progress.latest_frame() >= run_from &&
             sight.frame.number() >= sight.progress.latest_frame();
    }
  };

  bool attempt(const Step& step, const std::function<void()>& work) {
    try {
      work();
      return true;
    } catch (const Problem& problem) {
      if (problem.exit == Exit::kNoConnection) throw;
      if (problem.exit == Exit::kInterrupted) {
        result_.ended = false;
        return false;
      }
      std::string message = problem.what();
      for (const auto& [field, description] : problem.violations)
        message += fmt::format("; {}: {}", field, description);
      result_.failures.push_back({step.line, step.kind, message});
      return false;
    }
  }

  void do_step(const Step&, const CreateStep& what) {
    observe(what.session,
            what.drape ? create_session(connection_, make_drape(connection_, *what.drape).scene)
                       : create_session(connection_, what.scene));
  }

  void do_step(const Step&, const SnapshotStep& what) {
    v1::CreateSnapshotRequest request;
    request.set_parent(actors_.at(what.session).session.name());
    request.set_snapshot_id(fmt::format("script-{}", snapshots_.size() + 1));
    snapshots_[what.snapshot] = connection_.call(&Sessions::CreateSnapshot, request).name();
  }

  void do_step(const Step&, const RestoreStep& what) {
    v1::RestoreSessionRequest request;
    request.set_name(snapshots_.at(what.snapshot));
    observe(what.session, connection_.call(&Sessions::RestoreSession, request));
  }

  void observe(const std::string& name, v1::Session session) {
    Actor& actor = actors_[name];
    actor.session = std::move(session);
    actor.observer = std::make_unique<Observer>(connection_, actor.session, format_of(case_, name));
  }

  void do_step(const Step&, const SetStep& what) {
    const v1::Session now = connection_.get_session(actors_.at(what.session).session.name());
    connection_.call(&Sessions::UpdateTextile, textile_request(now, what.change));
  }

  void do_step(const Step&, const ActStep& what) {
    const v1::Session& session = actors_.at(what.session).session;
    v1::ApplyActionsRequest request;
    request.set_name(session.name());
    *request.add_actions() = to_action(what.action, session.scene());
    connection_.call(&Sessions::ApplyActions, request);
  }

  void do_step(const Step&, const RunStep& what) {
    std::vector<Actor*> started;
    for (const std::string& name : what.sessions) {
      Actor& actor = actors_.at(name);
      v1::RunSessionRequest request;
      request.set_name(actor.session.name());
      if (what.until_frame) request.set_until_frame(*what.until_frame);
      if (what.until_time_s) {
        const double frame_step = actor.session.scene().solver().frame_step_s();
        request.set_until_frame(std::llround(std::ceil(*what.until_time_s / frame_step - 1e-6)));
      }
      request.set_until_rest(what.until_rest);
      if (what.time_scale) request.set_time_scale(*what.time_scale);
      actor.run_from = connection_.call(&Sessions::RunSession, request).applied_frame();
      actor.running = true;
      if (what.wait) started.push_back(&actor);
    }
    for (Actor* actor : started) {
      actor->observer->await([&](const Sight& sight) { return actor->stands(sight); });
      actor->running = false;
    }
  }

  void do_step(const Step&, const WaitStep& what) {
    const Actor& actor = actors_.at(what.session);
    actor.observer->await([&](const Sight& sight) {
      const bool there = sight.tally.frames > 0 && sight.frame.number() >= what.frame;
      if (!there && actor.stands(sight)) {
        throw Problem(Exit::kRefused, "FAILED_PRECONDITION", "SESSION_PAUSED",
                      fmt::format("{} is paused at frame {} and will not reach {}", what.session,
                                  sight.frame.number(), what.frame));
      }
      return there;
    });
  }

  void do_step(const Step&, const PauseStep& what) { settle(actors_.at(what.session)); }

  void do_step(const Step&, const RecordStep& what) {
    const Actor& actor = actors_.at(what.session);
    catch_up(actor);
    actor.observer->record(what.path, replace_, actor.session.scene());
    result_.recordings.push_back(what.path);
  }

  void do_step(const Step& step, const ExpectStep& what) {
    const Actor& actor = actors_.at(what.session);
    const Sight sight = catch_up(actor);
    v1::Verdict verdict;
    if (needs_verdict(what)) {
      v1::GetVerdictRequest request;
      request.set_name(actor.session.name());
      verdict = connection_.call(&Sessions::GetVerdict, request);
    }
    for (const Expectation& expectation : what.expectations) {
      Finding finding{.line = step.line,
                      .name = expectation.name,
                      .value = value_of(sight, verdict, expectation),
                      .low = expectation.low,
                      .high = expectation.high};
      finding.passed = finding.value >= finding.low && finding.value <= finding.high;
      note(step, std::move(finding));
    }
    if (what.faults) note(step, finding_of(step, *what.faults, verdict));
  }

  void note(const Step& step, Finding finding) {
    if (!finding.passed) result_.failures.push_back({step.line, step.kind, finding_text(finding)});
    result_.findings.push_back(std::move(finding));
  }

  // Waits for the frame that the session is at now.
  Sight catch_up(const Actor& actor) {
    const std::int64_t newest = connection_.get_session(actor.session.name()).frame();
    return actor.observer->await([&](const Sight& sight) {
      return sight.tally.frames > 0 && sight.frame.number() >= newest;
    });
  }

  // Paused, and every frame seen and written.
  void settle(Actor& actor) {
    if (actor.observer == nullptr) return;
    if (actor.running) {
      v1::PauseSessionRequest request;
      request.set_name(actor.session.name());
      connection_.call(&Sessions::PauseSession, request);
      actor.running = false;
    }
    catch_up(actor);
    actor.observer->commit();
  }

  // After a stop too: nobody else knows of the session.
  void remove(const v1::Session& session) {
    if (session.name().empty()) return;
    v1::DeleteSessionRequest request;
    request.set_name(session.name());
    request.set_allow_missing(true);
    try {
      connection_.call(&Sessions::DeleteSession, request, std::stop_token());
    } catch (const Problem&) {
      // the server is gone, and with it the session
    }
  }

  Connection& connection_;
  const Case& case_;
  bool replace_;
  const std::function<void(const std::string&)>& progress_;
  std::map<std::string, Actor> actors_;
  std::map<std::string, std::string> snapshots_;  // their names on the server
  CaseResult result_;
};

}  // namespace

CaseResult perform(Connection& connection, const Case& performed, bool replace,
                   const std::function<void(const std::string& status)>& progress) {
  return Performer(connection, performed, replace, progress).perform();
}

std::string finding_text(const Finding& finding) {
  if (finding.verdict) {
    const auto& [faults, wanted, text] = *finding.verdict;
    return fmt::format("verdict is {}, not {}", faults.empty() ? "good" : text,
                       wanted.empty() ? "good" : fmt::format("{}", fmt::join(wanted, ", ")));
  }
  if (finding.name == "at_rest") return finding.value > 0 ? "is at rest" : "is not at rest";
  if (std::isnan(finding.value)) return fmt::format("{}: there is none", finding.name);
  const std::string head = fmt::format("{} is {:.6g}", finding.name, finding.value);
  if (finding.low == finding.high) return fmt::format("{}, not {:.6g}", head, finding.low);
  if (finding.value < finding.low) return fmt::format("{}, below {:.6g}", head, finding.low);
  return fmt::format("{}, above {:.6g}", head, finding.high);
}

}  // namespace weft::client
