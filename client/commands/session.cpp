#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include "client/commands/commands.h"
#include "client/output/text.h"
#include "client/scene_file.h"

namespace weft::client {
namespace {

using google::protobuf::util::TimeUtil;

struct CreateOptions {
  std::string path;
  std::string id;
  std::vector<std::string> refused;
};

void run_create(Context& context, const CreateOptions& options) {
  v1::CreateSessionRequest request;
  request.mutable_refused_warnings()->Add(options.refused.begin(), options.refused.end());
  request.set_session_id(options.id);
  const v1::Session session =
      create_session(context.connection(), read_scene(options.path), request);
  context.answer(to_json(session), "created " + session.name() + '\n' + plan_text(session.plan()));
}

void run_list(Context& context) {
  const v1::ListSessionsResponse all = list_sessions(context.connection());
  Table table({"SESSION", "STATE", "FRAME", "TIME", "AT REST", "SHEETS"});
  for (const auto& session : all.sessions()) {
    const auto known = [&](const std::string& text) { return is_shown(session) ? text : "-"; };
    table.add({session.name(), state_text(session), known(std::to_string(session.frame())),
               known(seconds_text(session.time_s())), known(session.at_rest() ? "yes" : "no"),
               std::to_string(session.scene().sheets_size())});
  }
  context.answer(to_json(all),
                 all.sessions().empty() ? "no sessions\n" : table.text(context.terminal.columns));
}

void run_get(Context& context, const std::string& name) {
  const v1::Session session = context.connection().get_session(context.session_name(name));
  context.answer(to_json(session), session_text(session) + plan_text(session.plan()));
}

struct SnapshotOptions {
  std::string session;
  std::string id;
};

void run_snapshot(Context& context, const SnapshotOptions& options) {
  v1::CreateSnapshotRequest request;
  request.set_parent(context.session_name(options.session));
  request.set_snapshot_id(options.id);
  const v1::Snapshot snapshot = context.connection().call(&Sessions::CreateSnapshot, request);
  context.answer(to_json(snapshot),
                 fmt::format("kept {}, {}, {}\n", snapshot.name(), seconds_text(snapshot.time_s()),
                             bytes_text(snapshot.size_bytes())));
}

void run_snapshots(Context& context, const std::string& session) {
  v1::ListSnapshotsRequest request;
  request.set_parent(context.session_name(session));
  const auto all = context.connection().call(&Sessions::ListSnapshots, request);
  Table table({"SNAPSHOT", "FRAME", "TIME", "SIZE", "TAKEN", "NUMERICS", "STATE"});
  for (const auto& snapshot : all.snapshots()) {
    table.add({snapshot.name().substr(snapshot.name().rfind('/') + 1),
               std::to_string(snapshot.frame()), seconds_text(snapshot.time_s()),
               bytes_text(snapshot.size_bytes()),
               TimeUtil::ToString(TimeUtil::SecondsToTimestamp(snapshot.create_time().seconds())),
               snapshot.numerics_id(),
               snapshot.damage().empty() ? "sound" : "damaged: " + snapshot.damage()});
  }
  context.answer(to_json(all),
                 all.snapshots().empty() ? "no snapshots\n" : table.text(context.terminal.columns));
}

struct RestoreOptions {
  std::string session;
  std::string snapshot;
  std::string id;
};

void run_restore(Context& context, const RestoreOptions& options) {
  v1::RestoreSessionRequest request;
  request.set_name(context.session_name(options.session) + "/snapshots/" + options.snapshot);
  request.set_session_id(options.id);
  const v1::Session session = context.connection().call(&Sessions::RestoreSession, request);
  context.answer(to_json(session),
                 fmt::format("created {}, paused at frame {}, {}\n", session.name(),
                             session.frame(), seconds_text(session.time_s())));
}

struct DeleteOptions {
  std::string session;
  bool allow_missing = false;
};

void run_delete(Context& context, const DeleteOptions& options) {
  v1::DeleteSessionRequest request;
  request.set_name(context.session_name(options.session));
  request.set_allow_missing(options.allow_missing);
  context.connection().call(&Sessions::DeleteSession, request);
  context.answer({{"deleted", request.name()}}, "deleted " + request.name() + '\n');
}

}  // namespace

void add_session(CLI::App& app, Context& context) {
  CLI::App* session = add_group(app, "session", "Create, show, keep and delete sessions");

  auto create = std::make_shared<CreateOptions>();
  CLI::App* command =
      session->add_subcommand("create", "Make a session, paused at frame 0, from a scene file");
  command->add_option("FILE", create->path, "Scene file")->option_text(" ")->required();
  command->add_option("--id", create->id, "Name of the session; else the server picks one")
      ->type_name("NAME");
  add_refuse_option(*command, create->refused);
  command->callback([&context, create] { run_create(context, *create); });

  command = session->add_subcommand("list", "List all sessions");
  command->callback([&context] { run_list(context); });

  auto name = std::make_shared<std::string>();
  command = session->add_subcommand("get", "Show one session");
  add_session_argument(*command, *name);
  command->callback([&context, name] { run_get(context, *name); });

  auto snapshot = std::make_shared<SnapshotOptions>();
  command = session->add_subcommand("snapshot", "Keep a session as it is, to be restored");
  add_session_argument(*command, snapshot->session);
  command->add_option("--id", snapshot->id, "Name of the snapshot; else it is frame-N")
      ->type_name("NAME");
  command->callback([&context, snapshot] { run_snapshot(context, *snapshot); });

  auto of = std::make_shared<std::string>();
  command = session->add_subcommand("snapshots", "List the snapshots of a session");
  add_session_argument(*command, *of);
  command->callback([&context, of] { run_snapshots(context, *of); });

  auto restore = std::make_shared<RestoreOptions>();
  command =
      session->add_subcommand("restore", "Make a session that goes on from a snapshot of another");
  add_session_argument(*command, restore->session);
  command->add_option("SNAPSHOT", restore->snapshot, "Name of the snapshot, such as frame-120")
      ->option_text(" ")
      ->required();
  command->add_option("--id", restore->id, "Name of the new session; else the server picks one")
      ->type_name("NAME");
  command->callback([&context, restore] { run_restore(context, *restore); });

  auto remove = std::make_shared<DeleteOptions>();
  command = session->add_subcommand("delete", "End a session and its streams");
  add_session_argument(*command, remove->session);
  command->add_flag("--allow-missing", remove->allow_missing, "Succeed when there is none");
  command->callback([&context, remove] { run_delete(context, *remove); });
}

}  // namespace weft::client
