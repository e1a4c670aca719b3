#include "server/rpc/session_service.h"

#include <stop_token>
#include <utility>

#include "core/model/text.h"
#include "server/convert/convert.h"
#include "server/convert/names.h"
#include "server/rpc/checks.h"
#include "server/rpc/errors.h"
#include "server/rpc/find.h"
#include "server/rpc/interaction.h"
#include "server/rpc/unary_call.h"

namespace weft {
namespace {

// A call that speaks of a session of its caller.
struct Asked {
  Caller caller;
  std::shared_ptr<Session> session;
};

// Calls `act` with the caller's session of that name and the call, which it finishes; or finishes
// it with what is wrong with either. The request lives until the call is finished.
template <class Act>
grpc::ServerUnaryReactor* on_session(Backend& backend, grpc::CallbackServerContext* context,
                                     const std::string& name, Act act,
                                     const std::string& field = "name") {
  const auto caller = backend.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  const auto& who = std::get<Caller>(caller);
  auto* call = new UnaryCall(backend.calls);
  const auto go_on = [call, who, act = std::move(act)](const FoundSession& found) {
    if (const auto* error = std::get_if<grpc::Status>(&found)) return call->Finish(*error);
    act(Asked{who, std::get<std::shared_ptr<Session>>(found)}, *call);
  };
  if (const auto found = find_here(backend, who, name, field)) {
    go_on(*found);
  } else {
    find_elsewhere(backend, who, name, go_on);
  }
  return call;
}

// Submits a command under the caller's name for it, and finishes the call with what becomes of it;
// `fill` writes the response.
template <class Message, class Fill>
void submit(UnaryCall& call, const Message& request, const Asked& asked, auto command, Fill fill) {
  const auto named = named_request(asked.caller, request, request.request_id());
  if (const auto* error = std::get_if<grpc::Status>(&named)) return call.Finish(*error);
  command.request = std::get<Request>(named);
  command.done = [&call, session = asked.session, fill](const Outcome& outcome) {
    if (const auto* refusal = std::get_if<Refusal>(&outcome)) {
      call.Finish(to_status(*refusal, *session));
    } else {
      fill(std::get<Applied>(outcome));
      call.Finish(grpc::Status::OK);
    }
  };
  asked.session->submit(std::move(command));
}

// Index of the sheet, or why there is none.
std::variant<std::size_t, grpc::Status> find_sheet(const Scene& scene, const std::string& name) {
  if (name.empty() && scene.sheets.size() == 1) return std::size_t{0};
  for (std::size_t i = 0; i < scene.sheets.size(); ++i) {
    if (scene.sheets[i].name == name) return i;
  }
  std::string names;
  for (const auto& sheet : scene.sheets) names += (names.empty() ? "" : ", ") + sheet.name;
  return errors::field_invalid("sheet", "\"" + name + "\" is none of the sheets: " + names);
}

// What is wrong with the request.
std::optional<grpc::Status> refusal_of(const v1::ListSessionsRequest& request) {
  constexpr int kMost = 1000;
  if (request.page_size() < 0 || request.page_size() > kMost) {
    return errors::field_invalid("page_size",
                                 std::to_string(request.page_size()) + " is not within 0 to 1000");
  }
  if (!request.page_token().empty() && !is_session_id(request.page_token()))
    return errors::field_invalid("page_token", "is none that this server gave");
  return std::nullopt;
}

std::size_t page_size_of(const v1::ListSessionsRequest& request) {
  constexpr int kDefault = 100;
  return static_cast<std::size_t>(request.page_size() == 0 ? kDefault : request.page_size());
}

// Of one session more than a page has, which tells that there is a next one.
v1::ListSessionsResponse page_of(v1::ListSessionsResponse response, std::size_t size) {
  const auto found = static_cast<std::size_t>(response.sessions_size());
  if (found <= size) return response;
  response.mutable_sessions()->RemoveLast();
  response.set_next_page_token(id_of(response.sessions(static_cast<int>(size) - 1).name()));
  return response;
}

}  // namespace

grpc::Status to_status(const Refusal& refusal, const Session& session) {
  const std::string name = session_name(session.id());
  const std::string frame = std::to_string(refusal.frame);
  const errors::Metadata latest = {{"latest_frame", frame}};
  switch (refusal.why) {
    case Refusal::Why::kDeleted:
      return errors::session_not_found(name);
    case Refusal::Why::kDraining:
      return errors::server_draining({{"last_frame", frame}});
    case Refusal::Why::kEvicted:
      return errors::wrong_replica(name, "");
    case Refusal::Why::kBusy:
      return errors::exhausted("commands", "too many calls wait for " + name, true);
    case Refusal::Why::kRunning:
      return errors::session_running(name, refusal.frame);
    case Refusal::Why::kFailed:
      return errors::solver_failed(session.status().failure, refusal.frame);
    case Refusal::Why::kStale:
      return errors::frame_stale(refusal.frame);
    case Refusal::Why::kNotAhead:
      return errors::not_ahead(refusal.frame);
    case Refusal::Why::kInterrupted:
      return errors::aborted("STEP_INTERRUPTED", name + " was paused after frame " + frame, latest);
    case Refusal::Why::kCancelled:
      return errors::cancelled();
    case Refusal::Why::kInvalid:
      return errors::field_invalid(refusal.problems);
    case Refusal::Why::kRequestUsed:
      return errors::request_used();
    case Refusal::Why::kNotKept:
      return errors::store_unwritable(refusal.text);
    case Refusal::Why::kSnapshotExists:
      return errors::snapshot_exists(snapshot_name(session.id(), refusal.text));
    case Refusal::Why::kTooManySnapshots:
      return errors::exhausted("snapshots_per_session",
                               name + " has as many snapshots as it may have: " +
                                   std::to_string(session.snapshots().size()),
                               false);
    case Refusal::Why::kUnstable:
      break;
  }
  if (!refusal.step.too_many_substeps) return errors::step_unstable(refusal.step, refusal.text);
  return errors::too_many_substeps(refusal.step, session.particle_count(), refusal.text);
}

grpc::ServerUnaryReactor* SessionService::GetSession(grpc::CallbackServerContext* context,
                                                     const v1::GetSessionRequest* request,
                                                     v1::Session* response) {
  return on_session(backend_, context, request->name(),
                    [this, response](const Asked& asked, UnaryCall& call) {
                      asked.session->keep_awake();
                      *response = to_proto(*asked.session);
                      response->set_replica(backend_.replica);
                      call.Finish(grpc::Status::OK);
                    });
}

grpc::ServerUnaryReactor* SessionService::ListSessions(grpc::CallbackServerContext* context,
                                                       const v1::ListSessionsRequest* request,
                                                       v1::ListSessionsResponse* response) {
  const auto caller = backend_.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  const auto& who = std::get<Caller>(caller);
  if (const auto error = refusal_of(*request)) return answer(context, *error);
  if (!backend_.store->has_others()) {
    *response = list(who, *request);
    return answer(context, grpc::Status::OK);
  }
  auto* call = new UnaryCall(backend_.calls);
  const auto listed = std::make_shared<v1::ListSessionsResponse>();
  backend_.store_calls.ask(
      [this, who, request = *request, listed] {
        try {
          *listed = list_all(who, request);
        } catch (const StoreError& error) {
          return errors::store_unreachable(error.what());
        }
        return grpc::Status::OK;
      },
      [call, response, listed](const grpc::Status& status) {
        if (status.ok()) response->Swap(listed.get());
        call->Finish(status);
      });
  return call;
}

v1::ListSessionsResponse SessionService::list(const Caller& caller,
                                              const v1::ListSessionsRequest& request) const {
  const std::size_t size = page_size_of(request);
  const auto sessions =
      backend_.registry.list(request.page_token(), size + 1,
                             caller.is_admin ? std::nullopt : std::optional(caller.principal));
  v1::ListSessionsResponse response;
  for (const auto& session : sessions)
    *response.add_sessions() = to_proto(*session, StartValues::kLeftOut);
  return page_of(std::move(response), size);
}

// Those that are not here without what changes of them.
v1::ListSessionsResponse SessionService::list_all(const Caller& caller,
                                                  const v1::ListSessionsRequest& request) const {
  const std::size_t size = page_size_of(request);
  const auto sessions =
      backend_.store->list(request.page_token(), size + 1,
                           caller.is_admin ? std::nullopt : std::optional(caller.principal));
  v1::ListSessionsResponse response;
  for (const auto& [identity, scene, replica] : sessions) {
    const auto here = backend_.registry.find(identity.id);
    v1::Session* session = response.add_sessions();
    *session = here ? to_proto(*here, StartValues::kLeftOut) : to_proto(identity, scene);
    session->set_replica(replica);
    if (!here && replica.empty()) session->set_state(v1::SESSION_STATE_STORED);
  }
  return page_of(std::move(response), size);
}

grpc::ServerUnaryReactor* SessionService::DeleteSession(grpc::CallbackServerContext* context,
                                                        const v1::DeleteSessionRequest* request,
                                                        v1::DeleteSessionResponse*) {
  const auto known_caller = backend_.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&known_caller)) return answer(context, *error);
  if (backend_.draining) return answer(context, errors::server_draining());
  const auto& caller = std::get<Caller>(known_caller);
  const auto named = named_request(caller, *request, request->request_id());
  if (const auto* error = std::get_if<grpc::Status>(&named)) return answer(context, *error);
  const Request& name = std::get<Request>(named);
  const auto known = backend_.requests.find(name);
  if (const auto* error = std::get_if<grpc::Status>(&known)) return answer(context, *error);
  if (std::get<std::optional<std::string>>(known)) return answer(context, grpc::Status::OK);

  auto* call = new UnaryCall(backend_.calls);
  const auto erase = [this, call, request, name](const FoundSession& found) {
    this->erase(*call, *request, name, found);
  };
  if (const auto found = find_here(backend_, caller, request->name())) {
    erase(*found);
    return call;
  }
  const auto found = std::make_shared<std::optional<FoundSession>>();
  backend_.store_calls.ask(
      [this, caller, name, of = request->name(), found] {
        try {
          const auto earlier = carried_out(name);
          if (const auto* error = std::get_if<grpc::Status>(&earlier)) return *error;
          if (!std::get<std::optional<CarriedOut>>(earlier))
            *found = find_anywhere(backend_, caller, of);
        } catch (const StoreError& error) {
          return errors::store_unreachable(error.what());
        }
        return grpc::Status::OK;
      },
      [call, found, erase](const grpc::Status& status) {
        if (!status.ok() || !*found) return call->Finish(status);
        erase(**found);
      });
  return call;
}

void SessionService::erase(UnaryCall& call, const v1::DeleteSessionRequest& request,
                           const Request& name, const FoundSession& found) {
  std::shared_ptr<Session> session;
  std::string uid;
  if (const auto* there = std::get_if<std::shared_ptr<Session>>(&found)) {
    session = *there;
    uid = session->uid();
  } else {
    const auto& error = std::get<grpc::Status>(found);
    const bool missing = error.error_code() == grpc::StatusCode::NOT_FOUND;
    if (missing && request.allow_missing()) return call.Finish(grpc::Status::OK);
    if (error.error_code() != grpc::StatusCode::DATA_LOSS) return call.Finish(error);
    if (const auto damaged = backend_.registry.damaged(id_of(request.name()))) uid = damaged->uid;
  }
  backend_.store->erase(
      uid, name,
      [this, &call, session, uid, name, id = id_of(request.name())](const std::string& error) {
        if (!error.empty()) return call.Finish(errors::store_unwritable(error));
        backend_.requests.remember(name, uid);
        if (session) {
          backend_.registry.erase(session);
        } else {
          backend_.registry.erase_damaged(id);
        }
        call.Finish(grpc::Status::OK);
      });
}

// What the caller's request came to, here or on another server. Waits for the store, and throws
// StoreError.
std::variant<std::optional<CarriedOut>, grpc::Status> SessionService::carried_out(
    const Request& request) const {
  const auto known = backend_.requests.find(request);
  if (const auto* error = std::get_if<grpc::Status>(&known)) return *error;
  if (const auto& uid = std::get<std::optional<std::string>>(known)) {
    const auto session = backend_.registry.find_uid(*uid);
    if (session || !backend_.store->is_shared())
      return CarriedOut{{request, *uid}, session ? session->id() : ""};
  }
  auto kept = backend_.store->find_request(request.id);
  if (kept && kept->kept.request.checksum != request.checksum) return errors::request_used();
  return kept;
}

grpc::ServerUnaryReactor* SessionService::UpdateTextile(grpc::CallbackServerContext* context,
                                                        const v1::UpdateTextileRequest* request,
                                                        v1::UpdateTextileResponse* response) {
  const auto update = [request, response](const Asked& asked, UnaryCall& call) {
    const auto sheet = find_sheet(asked.session->scene(), request->sheet());
    if (const auto* error = std::get_if<grpc::Status>(&sheet)) return call.Finish(*error);
    if (!request->has_textile()) return call.Finish(errors::field_invalid("textile", "is absent"));

    constexpr double kLongest = 1e4;  // s
    SetTextile command;
    command.sheet = std::get<std::size_t>(sheet);
    command.duration = request->duration_s();
    if (!(command.duration >= 0 && command.duration <= kLongest)) {  // NaN too
      return call.Finish(errors::field_invalid(
          "duration_s", join(command.duration, " s is not within 0 to 10000 s")));
    }
    command.edit = [request](const Textile& current) -> Converted<Textile> {
      auto edited = merge_textile(current, request->textile(), request->update_mask());
      const auto* textile = std::get_if<Textile>(&edited);
      if (textile != nullptr && request->duration_s() > 0 &&
          textile->model.index() != current.model.index()) {
        return std::vector<Problem>{
            {"duration_s",
             join(request->duration_s(),
                  " s lie between a measured and a raw textile; change between them at once")}};
      }
      return edited;
    };
    submit(call, *request, asked, std::move(command), [response](const Applied& applied) {
      response->set_applied_frame(applied.frame);
      *response->mutable_textile() = to_proto(applied.textile);
      *response->mutable_plan() = to_proto(*applied.plan);
    });
  };
  return on_session(backend_, context, request->name(), update);
}

grpc::ServerUnaryReactor* SessionService::ApplyActions(grpc::CallbackServerContext* context,
                                                       const v1::ApplyActionsRequest* request,
                                                       v1::ApplyActionsResponse* response) {
  const auto apply = [request, response](const Asked& asked, UnaryCall& call) {
    constexpr int kMost = 1000;
    if (request->actions_size() < 1 || request->actions_size() > kMost) {
      return call.Finish(errors::field_invalid(
          "actions",
          std::to_string(request->actions_size()) + " elements are not within 1 to 1000"));
    }
    Act command;
    std::vector<Problem> problems;
    for (int i = 0; i < request->actions_size(); ++i) {
      const auto action = to_action(request->actions(i), "actions[" + std::to_string(i) + "]");
      if (const auto* wrong = std::get_if<std::vector<Problem>>(&action)) {
        problems.insert(problems.end(), wrong->begin(), wrong->end());
      } else {
        command.actions.push_back(std::get<Action>(action));
      }
    }
    if (!problems.empty()) return call.Finish(errors::field_invalid(problems));
    submit(call, *request, asked, std::move(command),
           [response](const Applied& applied) { response->set_applied_frame(applied.frame); });
  };
  return on_session(backend_, context, request->name(), apply);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* SessionService::Interact(
    grpc::CallbackServerContext* context) {
  const auto interaction = std::make_shared<Interaction>(backend_, interactions_);
  interaction->start(*context);
  return interaction.get();
}

grpc::ServerUnaryReactor* SessionService::StepSession(grpc::CallbackServerContext* context,
                                                      const v1::StepSessionRequest* request,
                                                      v1::StepSessionResponse* response) {
  const auto step = [request, response](const Asked& asked, UnaryCall& call) {
    if (const auto problems = find_problems(*request); !problems.empty())
      return call.Finish(errors::field_invalid(problems));
    StepCommand command;
    command.frames = frames_of(*request);
    if (request->has_expected_frame()) command.expected_frame = request->expected_frame();

    std::stop_source stop;
    if (request->request_id().empty()) command.cancelled = stop.get_token();
    call.when_cancelled([session = asked.session, stop]() mutable {
      stop.request_stop();
      session->wake();
    });
    submit(call, *request, asked, std::move(command), [response](const Applied& applied) {
      response->set_applied_frame(applied.frame);
      response->set_frame(applied.newest);
      response->set_time_s(applied.time);
      response->set_at_rest(applied.at_rest);
    });
  };
  return on_session(backend_, context, request->name(), step);
}

grpc::ServerUnaryReactor* SessionService::RunSession(grpc::CallbackServerContext* context,
                                                     const v1::RunSessionRequest* request,
                                                     v1::RunSessionResponse* response) {
  const auto run = [request, response](const Asked& asked, UnaryCall& call) {
    if (const auto problems = find_problems(*request); !problems.empty())
      return call.Finish(errors::field_invalid(problems));
    RunCommand command;
    if (request->has_time_scale()) command.time_scale = request->time_scale();
    if (request->has_until_frame()) command.until_frame = request->until_frame();
    command.until_rest = request->until_rest();
    submit(call, *request, asked, std::move(command),
           [response](const Applied& applied) { response->set_applied_frame(applied.frame); });
  };
  return on_session(backend_, context, request->name(), run);
}

grpc::ServerUnaryReactor* SessionService::PauseSession(grpc::CallbackServerContext* context,
                                                       const v1::PauseSessionRequest* request,
                                                       v1::PauseSessionResponse* response) {
  const auto pause = [request, response](const Asked& asked, UnaryCall& call) {
    submit(call, *request, asked, PauseCommand{},
           [response](const Applied& applied) { response->set_applied_frame(applied.frame); });
  };
  return on_session(backend_, context, request->name(), pause);
}

grpc::ServerUnaryReactor* SessionService::GetVerdict(grpc::CallbackServerContext* context,
                                                     const v1::GetVerdictRequest* request,
                                                     v1::Verdict* response) {
  const auto judge = [response](const Asked& asked, UnaryCall& call) {
    const auto finish = [&call, response, session = asked.session](const Outcome& outcome) {
      if (const auto* refusal = std::get_if<Refusal>(&outcome))
        return call.Finish(to_status(*refusal, *session));
      const auto& seen = std::get<Applied>(outcome);
      *response = to_proto(*seen.judgement, seen.newest);
      call.Finish(grpc::Status::OK);
    };
    asked.session->submit(Judge{{}, finish});
  };
  return on_session(backend_, context, request->name(), judge);
}

grpc::ServerUnaryReactor* SessionService::CreateSnapshot(grpc::CallbackServerContext* context,
                                                         const v1::CreateSnapshotRequest* request,
                                                         v1::Snapshot* response) {
  const auto keep = [request, response](const Asked& asked, UnaryCall& call) {
    const std::string& id = request->snapshot_id();
    if (const auto error = refusal_of_id("snapshot_id", id)) return call.Finish(*error);
    const auto fill = [id, response, session = asked.session](const Applied& applied) {
      const std::string made = id.empty() ? default_snapshot_id(applied.newest) : id;
      for (const NamedSnapshot& snapshot : session->snapshots())
        if (snapshot.id == made) *response = to_proto(*session, snapshot);
    };
    submit(call, *request, asked, KeepSnapshot{id, {}, {}}, fill);
  };
  return on_session(backend_, context, request->parent(), keep, "parent");
}

grpc::ServerUnaryReactor* SessionService::ListSnapshots(grpc::CallbackServerContext* context,
                                                        const v1::ListSnapshotsRequest* request,
                                                        v1::ListSnapshotsResponse* response) {
  const auto list = [response](const Asked& asked, UnaryCall& call) {
    for (const NamedSnapshot& snapshot : asked.session->snapshots())
      *response->add_snapshots() = to_proto(*asked.session, snapshot);
    call.Finish(grpc::Status::OK);
  };
  return on_session(backend_, context, request->parent(), list, "parent");
}

}  // namespace weft
