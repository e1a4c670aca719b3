#include <new>
#include <utility>

#include "server/rpc/convert.h"
#include "server/rpc/errors.h"
#include "server/rpc/names.h"
#include "server/rpc/server_service.h"
#include "server/rpc/session_service.h"
#include "server/rpc/unary_call.h"

namespace weft {
namespace {

std::int64_t particles_of(const Scene& scene) {
  std::int64_t particles = 0;
  for (const auto& sheet : scene.sheets) {
    particles += std::int64_t{sheet.grid.rows} * sheet.grid.columns;
  }
  return particles;
}

grpc::Status refused_step(const Simulation& simulation, const StepRefusal& refusal) {
  const std::string solver = "session.scene.solver.";
  if (refusal.too_many_substeps && refusal.bound == 0) {
    return errors::field_invalid(solver + "substep_s",
                                 "is absent, and this integrator has no stable step for this scene "
                                 "to plan with; give one");
  }
  if (refusal.too_many_substeps) {
    return errors::field_invalid(
        solver + "frame_step_s",
        "a frame would need " + std::to_string(simulation.plan().step.substeps) +
            " substeps; at most " + std::to_string(kMaxSubsteps) + " are computed");
  }
  const bool asked = simulation.scene().solver.substep.has_value();
  return errors::step_unstable(refusal, solver + (asked ? "substep_s" : "integrator"));
}

grpc::Status refused(Registry::Refused refused, const std::string& id, const Limits& limits) {
  switch (refused) {
    case Registry::Refused::kExists:
      return errors::session_exists(session_name(id));
    case Registry::Refused::kFull:
      return errors::exhausted(
          "sessions",
          "the server holds " + std::to_string(limits.max_sessions) + " sessions, its most", true);
    case Registry::Refused::kClosed:
      break;
  }
  return errors::server_draining();
}

}  // namespace

// A call whose scene is being planned; answered once, by the planner or by a server that goes down.
class SessionService::Creation {
 public:
  Creation(const v1::CreateSessionRequest& asked, v1::Session* response,
           grpc::ServerUnaryReactor* reactor)
      : request(asked), response_(response), reactor_(reactor) {}

  void answer(const grpc::Status& status, v1::Session session = {}) {
    std::lock_guard lock(mutex_);
    if (reactor_ == nullptr) return;
    *response_ = std::move(session);
    std::exchange(reactor_, nullptr)->Finish(status);
  }

  const v1::CreateSessionRequest request;  // a copy: it may outlive the call

 private:
  std::mutex mutex_;
  v1::Session* response_;
  grpc::ServerUnaryReactor* reactor_;  // null: answered
};

bool SessionService::begin(const std::shared_ptr<Creation>& creation) {
  std::lock_guard lock(mutex_);
  if (backend_.draining) return false;
  creations_.insert(creation);
  return true;
}

void SessionService::end(const std::shared_ptr<Creation>& creation) {
  std::lock_guard lock(mutex_);
  creations_.erase(creation);
}

void SessionService::drain() {
  interactions_.drain();
  std::lock_guard lock(mutex_);
  for (const auto& creation : creations_) creation->answer(errors::server_draining());
}

// Planning a scene takes its time: not on a thread of gRPC's.
grpc::ServerUnaryReactor* SessionService::CreateSession(grpc::CallbackServerContext*,
                                                        const v1::CreateSessionRequest* request,
                                                        v1::Session* response) {
  auto* reactor = new UnaryCall(backend_.calls);
  const auto creation = std::make_shared<Creation>(*request, response, reactor);
  if (!begin(creation)) {
    creation->answer(errors::server_draining());
    return reactor;
  }
  const bool posted = backend_.planner.post([this, creation] {
    try {
      v1::Session session;
      const grpc::Status status = create(creation->request, session);
      creation->answer(status, std::move(session));
    } catch (const std::bad_alloc&) {
      creation->answer(
          errors::exhausted("memory", "the server has no memory for this scene", true));
    }
    end(creation);
  });
  if (!posted) {
    end(creation);
    creation->answer(errors::exhausted("creations", "too many sessions are being created", true));
  }
  return reactor;
}

grpc::Status SessionService::create(const v1::CreateSessionRequest& request,
                                    v1::Session& response) {
  if (!request.session_id().empty() && !is_session_id(request.session_id())) {
    return errors::field_invalid("session_id", "\"" + request.session_id() +
                                                   "\" is not 1 to 63 characters of a-z, 0-9 and "
                                                   "-, beginning with a letter");
  }
  if (!request.session().has_scene()) {
    return errors::field_invalid("session.scene", "is absent");
  }

  const auto named = named_request(request, request.request_id());
  if (const auto* error = std::get_if<grpc::Status>(&named)) return *error;
  const Request& name = std::get<Request>(named);
  const auto known = backend_.requests.find(name);
  if (const auto* error = std::get_if<grpc::Status>(&known)) return *error;
  if (const auto& uid = std::get<std::optional<std::string>>(known)) {
    return created_before(*uid, response);
  }

  // everything that is wrong with the scene, and its size, before anything is made of it
  auto converted = to_scene(request.session().scene(), "session.scene");
  if (const auto* problems = std::get_if<std::vector<Problem>>(&converted)) {
    return errors::field_invalid(*problems);
  }
  Scene& scene = std::get<Scene>(converted);
  const std::int64_t particles = particles_of(scene);
  if (particles > backend_.limits.max_particles_per_session) {
    return errors::exhausted("particles",
                             "the scene has " + std::to_string(particles) +
                                 " particles; a session may have " +
                                 std::to_string(backend_.limits.max_particles_per_session),
                             false);
  }
  const std::string id = request.session_id().empty() ? make_session_id() : request.session_id();
  if (!request.validate_only()) {
    if (const auto reason = backend_.registry.refusal(id)) {
      return refused(*reason, id, backend_.limits);
    }
  }

  Simulation simulation(std::move(scene));
  if (const auto refusal = simulation.refusal()) return refused_step(simulation, *refusal);
  const SessionIdentity identity = make_identity(id, numerics_id());
  const auto session = std::make_shared<Session>(identity, std::move(simulation), backend_.host(),
                                                 backend_.store->log_of(identity.uid, 0));
  response = to_proto(*session);
  if (request.validate_only()) {
    response.clear_name();
    response.clear_uid();
    response.clear_create_time();
    response.clear_numerics_id();
    return grpc::Status::OK;
  }
  try {
    backend_.store->add({identity, session->scene()}, name);
  } catch (const StoreError& error) {
    return errors::store_unwritable(error.what());
  }
  if (const auto reason = backend_.registry.add(session)) {
    backend_.store->erase(identity.uid, {}, [](const std::string&) {});
    return refused(*reason, id, backend_.limits);
  }
  backend_.requests.remember(name, session->uid());
  return grpc::Status::OK;
}

grpc::Status SessionService::created_before(const std::string& uid, v1::Session& response) const {
  const auto session = backend_.registry.find_uid(uid);
  if (!session) return errors::session_not_found("that this request made; it was deleted since");
  response = to_proto(*session);
  return grpc::Status::OK;
}

}  // namespace weft
