#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "server/rpc/backend.h"
#include "server/rpc/find.h"
#include "server/rpc/interaction.h"
#include "server/rpc/unary_call.h"
#include "weft/v1/session.grpc.pb.h"

namespace weft {

// Messages of Interact pass as bytes: gRPC would show those it cannot decode as the stream's end.
using SessionMethods = v1::SessionService::WithCallbackMethod_CreateSession<
    v1::SessionService::WithCallbackMethod_GetSession<
        v1::SessionService::WithCallbackMethod_ListSessions<
            v1::SessionService::WithCallbackMethod_DeleteSession<
                v1::SessionService::WithCallbackMethod_UpdateTextile<
                    v1::SessionService::WithCallbackMethod_StepSession<
                        v1::SessionService::WithCallbackMethod_RunSession<
                            v1::SessionService::WithCallbackMethod_PauseSession<
                                v1::SessionService::WithCallbackMethod_ApplyActions<
                                    v1::SessionService::WithCallbackMethod_CreateSnapshot<
                                        v1::SessionService::WithCallbackMethod_ListSnapshots<
                                            v1::SessionService::WithCallbackMethod_RestoreSession<
                                                v1::SessionService::WithCallbackMethod_GetVerdict<
                                                    v1::SessionService::
                                                        WithRawCallbackMethod_Interact<
                                                            v1::SessionService::
                                                                Service>>>>>>>>>>>>>>;

// Why a session did not carry a command out.
grpc::Status to_status(const Refusal& refusal, const Session& session);

class SessionService final : public SessionMethods {
 public:
  explicit SessionService(Backend& backend) : backend_(backend) {}

  grpc::ServerUnaryReactor* CreateSession(grpc::CallbackServerContext* context,
                                          const v1::CreateSessionRequest* request,
                                          v1::Session* response) override;
  grpc::ServerUnaryReactor* GetSession(grpc::CallbackServerContext* context,
                                       const v1::GetSessionRequest* request,
                                       v1::Session* response) override;
  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* context,
                                         const v1::ListSessionsRequest* request,
                                         v1::ListSessionsResponse* response) override;
  grpc::ServerUnaryReactor* DeleteSession(grpc::CallbackServerContext* context,
                                          const v1::DeleteSessionRequest* request,
                                          v1::DeleteSessionResponse* response) override;
  grpc::ServerUnaryReactor* UpdateTextile(grpc::CallbackServerContext* context,
                                          const v1::UpdateTextileRequest* request,
                                          v1::UpdateTextileResponse* response) override;
  grpc::ServerUnaryReactor* StepSession(grpc::CallbackServerContext* context,
                                        const v1::StepSessionRequest* request,
                                        v1::StepSessionResponse* response) override;
  grpc::ServerUnaryReactor* RunSession(grpc::CallbackServerContext* context,
                                       const v1::RunSessionRequest* request,
                                       v1::RunSessionResponse* response) override;
  grpc::ServerUnaryReactor* PauseSession(grpc::CallbackServerContext* context,
                                         const v1::PauseSessionRequest* request,
                                         v1::PauseSessionResponse* response) override;

  grpc::ServerUnaryReactor* ApplyActions(grpc::CallbackServerContext* context,
                                         const v1::ApplyActionsRequest* request,
                                         v1::ApplyActionsResponse* response) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Interact(
      grpc::CallbackServerContext* context) override;

  grpc::ServerUnaryReactor* GetVerdict(grpc::CallbackServerContext* context,
                                       const v1::GetVerdictRequest* request,
                                       v1::Verdict* response) override;

  grpc::ServerUnaryReactor* CreateSnapshot(grpc::CallbackServerContext* context,
                                           const v1::CreateSnapshotRequest* request,
                                           v1::Snapshot* response) override;
  grpc::ServerUnaryReactor* ListSnapshots(grpc::CallbackServerContext* context,
                                          const v1::ListSnapshotsRequest* request,
                                          v1::ListSnapshotsResponse* response) override;
  grpc::ServerUnaryReactor* RestoreSession(grpc::CallbackServerContext* context,
                                           const v1::RestoreSessionRequest* request,
                                           v1::Session* response) override;

  // Ends every interaction under way: the server is going down.
  void drain() { interactions_.drain(); }

 private:
  using Make = std::function<grpc::Status(v1::Session&)>;
  grpc::ServerUnaryReactor* create_later(std::int64_t particles, v1::Session* response, Make make);
  grpc::Status refusal(const Caller& caller, const v1::CreateSessionRequest& request,
                       const std::string& id) const;
  struct Begun {
    Request name;
    std::string id;
  };
  template <class CreateOrRestore>
  std::variant<Begun, grpc::Status> begin(const Caller& caller, const CreateOrRestore& request,
                                          v1::Session& response);
  std::shared_ptr<Session> make_session(const std::string& id, const Caller& caller,
                                        Simulation simulation, std::int64_t entries) const;
  grpc::Status create(const Caller& caller, const v1::CreateSessionRequest& request,
                      v1::Session& response);
  grpc::Status restore(const Caller& caller, const v1::RestoreSessionRequest& request,
                       v1::Session& response);
  grpc::Status keep(const std::shared_ptr<Session>& session, const Caller& caller,
                    const Request& name, const SessionSnapshot* beginning);
  std::variant<std::optional<CarriedOut>, grpc::Status> carried_out(const Request& request) const;
  grpc::Status created_before(const Caller& caller, const CarriedOut& creation,
                              v1::Session& response);
  v1::ListSessionsResponse list(const Caller& caller, const v1::ListSessionsRequest& request) const;
  v1::ListSessionsResponse list_all(const Caller& caller,
                                    const v1::ListSessionsRequest& request) const;
  void erase(UnaryCall& call, const v1::DeleteSessionRequest& request, const Request& name,
             const FoundSession& found);

  Backend& backend_;
  Interactions interactions_;
};

}  // namespace weft
