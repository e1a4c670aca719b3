#include <algorithm>
#include <mutex>
#include <utility>

#include "server/convert/convert.h"
#include "server/convert/mesh.h"
#include "server/convert/names.h"
#include "server/convert/numerics.h"
#include "server/rpc/assets.h"
#include "server/rpc/checks.h"
#include "server/rpc/errors.h"
#include "server/rpc/find.h"
#include "server/rpc/server_service.h"
#include "server/rpc/session_service.h"
#include "server/rpc/unary_call.h"

namespace weft {
namespace {

// So many particles are planned within a tenth of a second.
constexpr std::int64_t kLarge = 4096;

// Without sheets that are larger than any that is simulated, and those whose mesh is an asset.
std::int64_t particles_of(const v1::Scene& scene) {
  constexpr std::int64_t kMostRows = 4096;
  std::int64_t particles = 0;
  for (const auto& sheet : scene.sheets()) {
    const std::int64_t rows = sheet.grid().rows(), columns = sheet.grid().columns();
    const std::int64_t every = std::max(1, sheet.grid().simulated_every());
    if (std::min(rows, columns) > 0 && std::max(rows, columns) <= kMostRows)
      particles += ((rows - 1) / every + 1) * ((columns - 1) / every + 1);
    particles += weft::particles_of(sheet.triangles().data());
  }
  return particles;
}

// What is uploaded is, as a rule; bodies take their time to be made.
bool is_large(const v1::Scene& scene) {
  const auto large = [](const auto& all, const auto& is) {
    return std::any_of(all.begin(), all.end(), is);
  };
  return large(scene.sheets(),
               [](const v1::Sheet& sheet) { return sheet.triangles().has_asset(); }) ||
         large(scene.colliders(), [](const v1::Collider& collider) { return collider.has_mesh(); });
}

// With those that frames interpolate.
std::int64_t shown_particles_of(const Scene& scene) {
  std::int64_t particles = 0;
  for (const SheetDefinition& sheet : scene.sheets) particles += particle_count(shown(sheet.shape));
  return particles;
}

grpc::Status refused_step(const Simulation& simulation, const StepRefusal& refusal) {
  const std::string solver = "session.scene.solver.";
  if (refusal.too_many_substeps && refusal.bound == 0) {
    return errors::field_invalid(solver + "substep_s",
                                 "is absent, and this integrator has no stable step for this scene "
                                 "to plan with; give one");
  }
  if (refusal.too_many_substeps)
    return errors::too_many_substeps(refusal, simulation.particle_count(), solver + "frame_step_s");
  const bool asked = simulation.scene().solver.substep.has_value();
  return errors::step_unstable(refusal, solver + (asked ? "substep_s" : "integrator"));
}

std::vector<Problem> unknown_codes(const v1::CreateSessionRequest& request) {
  constexpr int kMost = 64;
  const auto& codes = request.refused_warnings();
  if (codes.size() > kMost)
    return {{"refused_warnings",
             "has " + std::to_string(codes.size()) + " codes, more than " + std::to_string(kMost)}};
  std::vector<Problem> problems;
  const auto known = warning_codes();
  for (int k = 0; k < codes.size(); ++k)
    if (std::find(known.begin(), known.end(), codes[k]) == known.end())
      problems.push_back({"refused_warnings[" + std::to_string(k) + "]",
                          "is \"" + codes[k] + "\", which is no code of a warning"});
  return problems;
}

std::vector<Problem> refused_warnings(const Plan& plan, const v1::CreateSessionRequest& request) {
  std::vector<Problem> problems;
  const auto& codes = request.refused_warnings();
  for (const Warning& warning : plan.warnings)
    if (std::find(codes.begin(), codes.end(), warning.code) != codes.end())
      problems.push_back({"session.scene" + (warning.field.empty() ? "" : "." + warning.field),
                          warning.code + ", which is refused: " + warning.message});
  return problems;
}

grpc::Status refused(const Registry::Refused& refused, const Caller& caller,
                     const std::string& id) {
  if (const auto* exists = std::get_if<Registry::Exists>(&refused)) {
    return caller.may_use(exists->owner) ? errors::session_exists(session_name(id))
                                         : errors::session_not_yours(session_name(id));
  }
  if (const auto* excess = std::get_if<Quota::Excess>(&refused)) return errors::exhausted(*excess);
  return errors::server_draining();
}

}  // namespace

grpc::ServerUnaryReactor* SessionService::CreateSession(grpc::CallbackServerContext* context,
                                                        const v1::CreateSessionRequest* request,
                                                        v1::Session* response) {
  const auto caller = backend_.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  const auto& who = std::get<Caller>(caller);
  // what a full server refuses does not wait for the plans of others
  if (const auto status = refusal(who, *request, request->session_id()); !status.ok())
    return answer(context, status);
  const v1::Scene& scene = request->session().scene();
  return create_later(is_large(scene) ? kLarge + 1 : particles_of(scene), response,
                      [this, who, request = *request](v1::Session& session) {
                        return create(who, request, session);
                      });
}

grpc::ServerUnaryReactor* SessionService::RestoreSession(grpc::CallbackServerContext* context,
                                                         const v1::RestoreSessionRequest* request,
                                                         v1::Session* response) {
  const auto caller = backend_.access.caller(*context);
  if (const auto* error = std::get_if<grpc::Status>(&caller)) return answer(context, *error);
  const auto parts = read_snapshot_name(request->name());
  const auto source = parts ? backend_.registry.find(parts->session) : nullptr;
  return create_later(source ? source->particle_count() : 0, response,
                      [this, who = std::get<Caller>(caller), request = *request](
                          v1::Session& session) { return restore(who, request, session); });
}

// Planning a scene takes its time: not on a thread of gRPC's, and small ones do not wait for large
// ones. `make` has copies of what it needs: it may outlive the call.
grpc::ServerUnaryReactor* SessionService::create_later(std::int64_t particles,
                                                       v1::Session* response, Make make) {
  auto* call = new UnaryCall(backend_.calls);
  const auto session = std::make_shared<v1::Session>();
  SlowCalls& planner = particles > kLarge ? backend_.large_planner : backend_.planner;
  planner.ask(
      [this, session, make = std::move(make)] {
        try {
          grpc::Status status = make(*session);
          if (!session->name().empty()) session->set_replica(backend_.replica);
          return status;
        } catch (const StoreError& error) {
          return errors::store_unreachable(error.what());
        }
      },
      [call, response, session](const grpc::Status& status) {
        if (status.ok()) response->Swap(session.get());
        call->Finish(status);
      });
  return call;
}

// Whether the session, or what the request made before, could be had; its scene is not looked at.
grpc::Status SessionService::refusal(const Caller& caller, const v1::CreateSessionRequest& request,
                                     const std::string& id) const {
  if (request.validate_only()) return grpc::Status::OK;
  const auto named = named_request(caller, request, request.request_id());
  if (const auto* error = std::get_if<grpc::Status>(&named)) return *error;
  const auto known = backend_.requests.find(std::get<Request>(named));
  if (const auto* error = std::get_if<grpc::Status>(&known)) return *error;
  if (std::get<std::optional<std::string>>(known)) return grpc::Status::OK;
  const std::int64_t particles = particles_of(request.session().scene());
  const auto reason = backend_.registry.refusal(id, caller.principal, particles);
  return reason ? refused(*reason, caller, id) : grpc::Status::OK;
}

// What a call that makes a session begins with: the name of the request, and the session's id. Or
// its status, where it is refused, or was carried out before and is answered.
template <class CreateOrRestore>
std::variant<SessionService::Begun, grpc::Status> SessionService::begin(
    const Caller& caller, const CreateOrRestore& request, v1::Session& response) {
  if (const auto error = refusal_of_id("session_id", request.session_id())) return *error;
  const auto named = named_request(caller, request, request.request_id());
  if (const auto* error = std::get_if<grpc::Status>(&named)) return *error;
  const Request& name = std::get<Request>(named);
  const auto known = carried_out(name);
  if (const auto* error = std::get_if<grpc::Status>(&known)) return *error;
  if (const auto& creation = std::get<std::optional<CarriedOut>>(known))
    return created_before(caller, *creation, response);
  return Begun{name, request.session_id().empty() ? make_session_id() : request.session_id()};
}

// Its log goes on after so many entries.
std::shared_ptr<Session> SessionService::make_session(const std::string& id, const Caller& caller,
                                                      Simulation simulation,
                                                      std::int64_t entries) const {
  const SessionIdentity identity =
      make_identity(id, numerics_id(), caller.principal, backend_.limits.max_frame_work);
  return std::make_shared<Session>(identity, std::move(simulation), backend_.host(),
                                   backend_.store->log_of(identity.uid, entries));
}

grpc::Status SessionService::create(const Caller& caller, const v1::CreateSessionRequest& request,
                                    v1::Session& response) {
  const auto begun = begin(caller, request, response);
  if (const auto* status = std::get_if<grpc::Status>(&begun)) return *status;
  const auto& [name, id] = std::get<Begun>(begun);
  if (!request.session().has_scene()) {
    return errors::field_invalid("session.scene", "is absent");
  }

  if (const auto problems = unknown_codes(request); !problems.empty())
    return errors::field_invalid(problems);

  // everything that is wrong with the scene, and its size, before anything is made of it
  const auto mesh = [&](const std::string& asset) {
    return find_mesh(backend_.store->assets(), caller, asset);
  };
  auto converted = to_scene(request.session().scene(), "session.scene", mesh, &backend_.scheduler);
  if (const auto* problems = std::get_if<std::vector<Problem>>(&converted)) {
    return errors::field_invalid(*problems);
  }
  Scene& scene = std::get<Scene>(converted);
  const auto fresh = name_meshes(request.session().scene(), scene);
  const std::int64_t particles = shown_particles_of(scene);
  if (particles > backend_.limits.max_particles_per_session) {
    return errors::exhausted("particles_per_session",
                             "the scene has " + std::to_string(particles) +
                                 " particles; a session may have " +
                                 std::to_string(backend_.limits.max_particles_per_session),
                             false);
  }
  if (auto status = refusal(caller, request, id); !status.ok()) return status;

  Simulation simulation(std::move(scene));
  simulation.limit_frame_work(backend_.limits.max_frame_work);
  if (const auto refusal = simulation.refusal()) return refused_step(simulation, *refusal);
  if (const auto problems = refused_warnings(simulation.plan(), request); !problems.empty())
    return errors::field_invalid(problems);
  const auto session = make_session(id, caller, std::move(simulation), 0);
  response = to_proto(*session);
  if (request.validate_only()) {
    response.clear_name();
    response.clear_uid();
    response.clear_create_time();
    response.clear_numerics_id();
    response.clear_owner();
    return grpc::Status::OK;
  }
  if (auto status = keep_assets(backend_, caller.principal, session->scene(), fresh); !status.ok())
    return status;
  return keep(session, caller, name, nullptr);
}

// Adds a new session to the store and the registry.
grpc::Status SessionService::keep(const std::shared_ptr<Session>& session, const Caller& caller,
                                  const Request& name, const SessionSnapshot* beginning) {
  // nobody finds it in the one before it is in the other
  const std::lock_guard one_at_a_time(backend_.claiming);
  const SessionIdentity& identity = session->identity();
  try {
    backend_.store->add({identity, session->scene()}, name, beginning);
  } catch (const SessionExists& there) {
    return refused(Registry::Exists{there.owner}, caller, session->id());
  } catch (const StoreError& error) {
    return errors::store_unwritable(error.what());
  }
  if (const auto reason = backend_.registry.add(session)) {
    backend_.store->erase(session->uid(), {}, [](const std::string&) {});
    return refused(*reason, caller, session->id());
  }
  backend_.requests.remember(name, session->uid());
  return grpc::Status::OK;
}

grpc::Status SessionService::restore(const Caller& caller, const v1::RestoreSessionRequest& request,
                                     v1::Session& response) {
  const auto parts = read_snapshot_name(request.name());
  if (!parts) {
    return errors::field_invalid(
        "name", "\"" + request.name() + "\" is not sessions/{session}/snapshots/{snapshot}");
  }
  const auto begun = begin(caller, request, response);
  if (const auto* status = std::get_if<grpc::Status>(&begun)) return *status;
  const auto& [name, id] = std::get<Begun>(begun);

  const auto found = find_anywhere(backend_, caller, parts->session);
  if (const auto* error = std::get_if<grpc::Status>(&found)) return *error;
  const Session& source = *std::get<std::shared_ptr<Session>>(found);
  const auto snapshots = source.snapshots();
  const bool there = std::any_of(snapshots.begin(), snapshots.end(),
                                 [&](const NamedSnapshot& each) { return each.id == parts->id; });
  if (!there) return errors::snapshot_not_found(request.name());
  if (const auto reason = backend_.registry.refusal(id, caller.principal, source.particle_count()))
    return refused(*reason, caller, id);

  // all that came before it is one entry of a log that is forgotten, see SessionStore::add()
  SavedSession saved;
  saved.first = 1;
  try {
    saved.snapshot = backend_.store->named_snapshot(source.uid(), parts->id);
  } catch (const StoreError& error) {
    return errors::snapshot_damaged(request.name(), error.what());
  }
  SessionSnapshot& snapshot = *saved.snapshot;
  snapshot.entries = saved.first;
  snapshot.under_way.clear();
  snapshot.answers.clear();
  saved.limit.frame = snapshot.simulation.frame;

  if (const auto& step = snapshot.simulation.plan.step;
      step.substeps * source.particle_count() > backend_.limits.max_frame_work) {
    const StepRefusal refusal{step.substep, step.linear_bound, true, step.substeps,
                              backend_.limits.max_frame_work / source.particle_count()};
    return errors::too_many_substeps(refusal, source.particle_count(), "name");
  }

  const auto session = make_session(id, caller, Simulation(source.scene()), saved.first);
  if (auto status = keep_assets(backend_, caller.principal, session->scene(), {}); !status.ok())
    return status;
  const SessionSnapshot beginning = snapshot;
  if (!session->restore(std::move(saved)))
    return errors::snapshot_damaged(request.name(), "it does not fit the scene of its session");
  if (auto status = keep(session, caller, name, &beginning); !status.ok()) return status;
  response = to_proto(*session);
  return grpc::Status::OK;
}

grpc::Status SessionService::created_before(const Caller& caller, const CarriedOut& creation,
                                            v1::Session& response) {
  if (creation.id.empty())
    return errors::session_not_found("that this request made; it was deleted since");
  const auto found = find_anywhere(backend_, caller, session_name(creation.id));
  if (const auto* error = std::get_if<grpc::Status>(&found)) return *error;
  response = to_proto(*std::get<std::shared_ptr<Session>>(found));
  return grpc::Status::OK;
}

}  // namespace weft
