#include <rapidcheck.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <vector>

#include "server/convert/convert.h"
#include "tests/support/service/assets.h"
#include "tests/support/service/service.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

using Sessions = Service::Sessions;
using grpc::StatusCode;

// One call, in numbers that each kind reads as it needs them.
struct Call {
  enum Kind {
    kCreate,
    kDelete,
    kStep,
    kRun,
    kPause,
    kSetTextile,
    kGrab,
    kDrag,
    kRelease,
    kPin,
    kUnpin,
    kPose,
    kRelax,
    kSnapshot,
    kRestore,
    kAgain,
    kRestart,
    kKinds
  };
  Kind kind = kCreate;
  int session = 0;   // of three names
  int number = 0;    // -2 to 4: frames, or part of a particle or a value
  int particle = 0;  // -1 to 20, one beyond the sheet on both sides
};

std::ostream& operator<<(std::ostream& out, const Call& call) {
  constexpr std::array<const char*, Call::kKinds> kNames = {
      "create", "delete", "step", "run",   "pause",    "set textile", "grab",  "drag",   "release",
      "pin",    "unpin",  "pose", "relax", "snapshot", "restore",     "again", "restart"};
  return out << kNames[call.kind] << " s" << call.session << ' ' << call.number << " particle "
             << call.particle;
}

}  // namespace
}  // namespace weft::testing

namespace rc {

template <>
struct Arbitrary<weft::testing::Call> {
  static Gen<weft::testing::Call> arbitrary() {
    using weft::testing::Call;
    const auto kind = gen::map(gen::weightedElement<int>({{3, Call::kCreate},
                                                          {1, Call::kDelete},
                                                          {6, Call::kStep},
                                                          {3, Call::kRun},
                                                          {1, Call::kPause},
                                                          {4, Call::kSetTextile},
                                                          {4, Call::kGrab},
                                                          {4, Call::kDrag},
                                                          {2, Call::kRelease},
                                                          {2, Call::kPin},
                                                          {2, Call::kUnpin},
                                                          {3, Call::kPose},
                                                          {2, Call::kRelax},
                                                          {3, Call::kSnapshot},
                                                          {3, Call::kRestore},
                                                          {2, Call::kAgain},
                                                          {1, Call::kRestart}}),
                               [](int value) { return static_cast<Call::Kind>(value); });
    return gen::build<Call>(gen::set(&Call::kind, kind),
                            gen::set(&Call::session, gen::inRange(0, 3)),
                            gen::set(&Call::number, gen::inRange(-2, 5)),
                            // few, so that calls meet
                            gen::set(&Call::particle, gen::element(-1, 0, 7, 13, 20)));
  }
};

}  // namespace rc

namespace weft::testing {
namespace {

// The cube stays below the sheet until a call leads it into it.
v1::Scene sheet_on_cube() { return posed_scene(0.08F, -0.1F, 0.03F); }

// What sessions are when calls are carried out one after the other, by core alone.
struct Modelled {
  Simulation simulation;
  std::string shown;  // positions of its newest frame
  std::set<int> grabbed = {}, pinned = {0, 4};
  struct Kept {
    Snapshot state;
    std::set<int> grabbed, pinned;
  };
  std::map<std::string, Kept> kept = {};  // by the snapshot's id
};

class History {
 public:
  History() { start(); }

  void carry_out(const Call& call) {
    ++calls_;
    const std::string id = "s" + std::to_string(call.session);
    name_ = "sessions/" + id;
    const auto found = model_.find(id);
    there_ = found == model_.end() ? nullptr : &found->second;
    switch (call.kind) {
      case Call::kCreate:
        return create(id);
      case Call::kDelete:
        return erase(id, call.number > 1);
      case Call::kStep:
        return step(call.number, call.particle);
      case Call::kRun:
        return run(call.number);
      case Call::kPause:
        return pause();
      case Call::kSetTextile:
        return set_textile(call.number, call.particle);
      case Call::kSnapshot:
        return keep(call.number);
      case Call::kRestore:
        return restore(id, "s" + std::to_string(std::abs(call.session - call.number) % 3),
                       call.number);
      case Call::kAgain:
        return again();
      case Call::kRestart:
        return restart();
      default:
        return act(call);
    }
  }

  void expect_as_modelled() {
    std::set<std::string> names;
    grpc::ClientContext context;
    v1::ListSessionsResponse list;
    RC_ASSERT(service_->sessions->ListSessions(&context, {}, &list).ok());
    for (const auto& session : list.sessions()) names.insert(session.name().substr(9));
    std::set<std::string> expected;
    for (const auto& [id, modelled] : model_) expected.insert(id);
    RC_ASSERT(names == expected);
    for (const auto& [id, modelled] : model_) {
      v1::Session session;
      session.set_name("sessions/" + id);
      session = service_->get(session);
      const Simulation& simulation = modelled.simulation;
      RC_ASSERT(session.frame() == simulation.frame());
      RC_ASSERT(session.state() == v1::SESSION_STATE_PAUSED);
      RC_ASSERT(session.scene().sheets(0).textile().SerializeAsString() ==
                to_proto(simulation.scene().sheets[0].textile).SerializeAsString());
      RC_ASSERT(newest(session) == modelled.shown);
    }
  }

 private:
  void start() {
    ServerOptions options = Service::in_process();
    options.data_dir = directory_.name();
    options.snapshot_ms = 0;
    service_ = std::make_unique<Service>(options);
  }

  void restart() {
    service_.reset();
    start();
    for (const auto& [id, modelled] : model_) {  // calls wait until a session is restored
      v1::PauseSessionRequest request;
      request.set_name("sessions/" + id);
      RC_ASSERT(service_->error(&Sessions::PauseSession, request).code == StatusCode::OK);
    }
  }

  template <class Request, class Response>
  Response ask(grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&, Response*),
               Request request, StatusCode code, const std::string& reason) {
    request.set_request_id("call-" + std::to_string(calls_));
    Response response;
    const grpc::Status status = service_->call(method, request, &response);
    const Error error(status);
    RC_ASSERT(error.code == code);
    RC_ASSERT(error.reason() == reason);
    again_ = {};
    if (code == StatusCode::OK)
      again_ = [this, method, request, said = response.SerializeAsString()] {
        Response repeated;
        RC_ASSERT(service_->call(method, request, &repeated).ok());
        RC_ASSERT(repeated.SerializeAsString() == said);
      };
    return response;
  }

  // The latest call that was carried out is sent once more.
  void again() {
    if (again_) again_();
  }

  void create(const std::string& id) {
    v1::CreateSessionRequest request;
    *request.mutable_session()->mutable_scene() = sheet_on_cube();
    request.set_session_id(id);
    if (there_ != nullptr) {
      ask(&Sessions::CreateSession, request, StatusCode::ALREADY_EXISTS, "SESSION_EXISTS");
    } else {
      ask(&Sessions::CreateSession, request, StatusCode::OK, "");
      again_ = {};  // answers with the session as it is by then
      model_.emplace(id, Modelled{simulation(), {}});
      there_ = &model_.at(id);
      advance(0);
    }
  }

  void erase(const std::string& id, bool allow_missing) {
    v1::DeleteSessionRequest request;
    request.set_name(name_);
    request.set_allow_missing(allow_missing);
    if (there_ == nullptr && !allow_missing)
      ask(&Sessions::DeleteSession, request, StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
    else
      ask(&Sessions::DeleteSession, request, StatusCode::OK, "");
    model_.erase(id);
  }

  // The codes of calls that change a session, `valid` where there is one.
  template <class Request, class Response>
  Response change(grpc::Status (Sessions::*method)(grpc::ClientContext*, const Request&, Response*),
                  Request request, StatusCode valid, const std::string& reason) {
    request.set_name(name_);
    return there_ == nullptr ? ask(method, request, StatusCode::NOT_FOUND, "SESSION_NOT_FOUND")
                             : ask(method, request, valid, reason);
  }

  std::int64_t frame() const { return there_ == nullptr ? 0 : there_->simulation.frame(); }

  void advance(std::int64_t frames) {
    for (; frames > 0; --frames) RC_ASSERT(there_->simulation.advance_frame());
    there_->shown = positions(there_->simulation);
  }

  void step(int frames, int expected) {
    v1::StepSessionRequest request;
    request.set_frames(frames);
    const bool stale = expected == 13;
    if (expected > 0) request.set_expected_frame(frame() + (stale ? 1 : 0));
    if (frames < 1) {
      change(&Sessions::StepSession, request, StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
    } else if (stale) {
      change(&Sessions::StepSession, request, StatusCode::ABORTED, "FRAME_STALE");
    } else {
      const auto response = change(&Sessions::StepSession, request, StatusCode::OK, "");
      if (there_ == nullptr) return;
      advance(frames);
      RC_ASSERT(response.frame() == frame());
      RC_ASSERT(response.applied_frame() == frame() - frames + 1);
      RC_ASSERT(response.at_rest() == there_->simulation.at_rest());
    }
  }

  void run(int frames) {
    v1::RunSessionRequest request;
    request.set_until_frame(frame() + frames);
    if (frames < 1) {
      change(&Sessions::RunSession, request, StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
      return;
    }
    change(&Sessions::RunSession, request, StatusCode::OK, "");
    if (there_ == nullptr) return;
    advance(frames);
    v1::Session session;
    session.set_name(name_);
    Stream(*service_, frames_of(session, frame(), frame())).rest();  // it ends with the run
  }

  void pause() {
    const auto response =
        change(&Sessions::PauseSession, v1::PauseSessionRequest(), StatusCode::OK, "");
    if (there_ != nullptr) RC_ASSERT(response.applied_frame() == frame() + 1);
  }

  void set_textile(int number, int particle) {
    v1::UpdateTextileRequest request;
    const double stretch = number == 4 ? std::nan("") : 100.0 * number;  // negative, too
    request.mutable_textile()->mutable_raw()->set_stretch_n_per_m(stretch);
    request.mutable_update_mask()->add_paths("raw.stretch_n_per_m");
    const double duration = particle < 0 ? -1 : particle / 200.0;
    if (duration != 0) request.set_duration_s(duration);
    if (duration < 0 || !(stretch >= 0)) {
      change(&Sessions::UpdateTextile, request, StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
      return;
    }
    const auto response = change(&Sessions::UpdateTextile, request, StatusCode::OK, "");
    if (there_ == nullptr) return;
    Textile textile = there_->simulation.target_textile(0);
    std::get<RawTextile>(textile.model).stretch = stretch;
    RC_ASSERT(!there_->simulation.set_textile(0, textile, duration));
    RC_ASSERT(response.applied_frame() == frame() + 1);
    RC_ASSERT(response.textile().raw().stretch_n_per_m() == stretch);
  }

  void act(const Call& call) {
    constexpr int kParticles = 20;
    const int p = call.particle;
    v1::ApplyActionsRequest request;
    v1::Action* action = request.add_actions();
    Action done{.particle = p};
    bool valid = p >= 0 && p < kParticles;
    const bool grabbed = there_ != nullptr && there_->grabbed.contains(p);
    const bool pinned = there_ != nullptr && there_->pinned.contains(p);
    switch (call.kind) {
      case Call::kGrab:
        action->mutable_grab()->set_particle(p);
        done.kind = Action::Kind::kGrab;
        valid = valid && !grabbed;
        break;
      case Call::kDrag:
        action->mutable_drag()->set_particle(p);
        done.kind = Action::Kind::kDrag;
        done.target = {0.05 * call.number, 0.02, 0.1};
        action->mutable_drag()->mutable_target_m()->set_x(done.target.x());
        action->mutable_drag()->mutable_target_m()->set_y(done.target.y());
        action->mutable_drag()->mutable_target_m()->set_z(done.target.z());
        valid = valid && grabbed;
        break;
      case Call::kRelease:
        action->mutable_release()->set_particle(p);
        done.kind = Action::Kind::kRelease;
        valid = valid && grabbed;
        break;
      case Call::kPin:
        action->mutable_pin()->set_particle(p);
        done.kind = Action::Kind::kPin;
        valid = valid && !pinned;
        break;
      case Call::kPose:
        done = {.kind = Action::Kind::kPoseCollider, .pose_time = 10 + 0.3 * call.number};
        action->mutable_pose_collider()->set_pose_time_s(done.pose_time);
        if (p >= 0) {
          done.pose_speed = 0.1 * p;
          action->mutable_pose_collider()->set_speed_m_per_s(done.pose_speed);
        }
        valid = done.pose_time >= 10 && done.pose_time <= 11 && done.pose_speed > 0;
        break;
      case Call::kRelax:
        action->mutable_relax();
        done = {.kind = Action::Kind::kRelax};
        valid = true;
        break;
      default:
        action->mutable_unpin()->set_particle(p);
        done.kind = Action::Kind::kUnpin;
        valid = valid && pinned;
    }
    if (!valid) {
      change(&Sessions::ApplyActions, request, StatusCode::INVALID_ARGUMENT, "FIELD_INVALID");
      return;
    }
    const auto response = change(&Sessions::ApplyActions, request, StatusCode::OK, "");
    if (there_ == nullptr) return;
    RC_ASSERT(response.applied_frame() == frame() + 1);
    RC_ASSERT(!there_->simulation.act({done}));
    if (call.kind == Call::kGrab) there_->grabbed.insert(p);
    if (call.kind == Call::kRelease) there_->grabbed.erase(p);
    if (call.kind == Call::kPin) there_->pinned.insert(p);
    if (call.kind == Call::kUnpin) there_->pinned.erase(p);
  }

  static Simulation simulation() {
    return Simulation(std::get<Scene>(to_scene(sheet_on_cube(), "scene")));
  }

  void keep(int number) {
    v1::CreateSnapshotRequest request;
    request.set_parent(name_);
    if (number >= 0) request.set_snapshot_id("n" + std::to_string(number));
    if (there_ == nullptr) {
      ask(&Sessions::CreateSnapshot, request, StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
      return;
    }
    const std::string id = number < 0 ? "frame-" + std::to_string(frame()) : request.snapshot_id();
    if (there_->kept.contains(id)) {
      ask(&Sessions::CreateSnapshot, request, StatusCode::ALREADY_EXISTS, "SNAPSHOT_EXISTS");
      return;
    }
    const auto response = ask(&Sessions::CreateSnapshot, request, StatusCode::OK, "");
    RC_ASSERT(response.name() == name_ + "/snapshots/" + id);
    RC_ASSERT(response.frame() == frame());
    there_->kept.emplace(
        id, Modelled::Kept{there_->simulation.snapshot(), there_->grabbed, there_->pinned});
  }

  void restore(const std::string& id, const std::string& from, int number) {
    const auto source = model_.find(from);
    const std::string frame =
        source == model_.end() ? "0" : std::to_string(source->second.simulation.frame());
    const std::string snapshot = number < 0 ? "frame-" + frame : "n" + std::to_string(number);
    v1::RestoreSessionRequest request;
    request.set_name("sessions/" + from + "/snapshots/" + snapshot);
    request.set_session_id(id);
    if (source == model_.end()) {
      ask(&Sessions::RestoreSession, request, StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
    } else if (!source->second.kept.contains(snapshot)) {
      ask(&Sessions::RestoreSession, request, StatusCode::NOT_FOUND, "SNAPSHOT_NOT_FOUND");
    } else if (there_ != nullptr) {
      ask(&Sessions::RestoreSession, request, StatusCode::ALREADY_EXISTS, "SESSION_EXISTS");
    } else {
      ask(&Sessions::RestoreSession, request, StatusCode::OK, "");
      again_ = {};  // answers with the session as it is by then
      const auto& kept = source->second.kept.at(snapshot);
      Modelled restored{simulation(), {}, kept.grabbed, kept.pinned};
      RC_ASSERT(restored.simulation.restore(kept.state));
      restored.shown = positions(restored.simulation);
      model_.emplace(id, std::move(restored));
    }
  }

  // As a frame in double precision has them.
  static std::string positions(const Simulation& simulation) {
    std::vector<double> values(3 * static_cast<std::size_t>(simulation.particle_count()));
    simulation.copy_positions(values);
    std::string bytes(sizeof(double) * values.size(), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
  }
  std::string newest(const v1::Session& session) {
    return Stream(*service_, frames_of(session, session.frame(), session.frame()))
        .rest()
        .at(0)
        .positions_m();
  }

  const TemporaryDirectory directory_;
  std::unique_ptr<Service> service_;
  std::map<std::string, Modelled> model_;
  int calls_ = 0;
  std::function<void()> again_;
  std::string name_;           // of the call under way
  Modelled* there_ = nullptr;  // its session
};

TEST(RandomCalls, LeaveSessionsAsIfCoreHadCarriedThemOutOneAfterTheOther) {
  spdlog::set_level(spdlog::level::warn);
  constexpr int kMostCalls = 30;
  EXPECT_TRUE(rc::check([] {
    const auto calls = *rc::gen::resize(kMostCalls, rc::gen::arbitrary<std::vector<Call>>());
    History history;
    for (const Call& call : calls) {
      history.carry_out(call);
      history.expect_as_modelled();
    }
  }));
}

}  // namespace
}  // namespace weft::testing
