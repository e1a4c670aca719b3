#include "client/commands/commands.h"
#include "client/output/text.h"
#include "client/scene_file.h"

namespace weft::client {
namespace {

struct CreateOptions {
  std::string path;
  std::string id;
};

void run_create(Context& context, const CreateOptions& options) {
  v1::CreateSessionRequest request;
  request.set_session_id(options.id);
  const v1::Session session =
      create_session(context.connection(), read_scene(options.path), request);
  context.answer(to_json(session), "created " + session.name() + '\n' + plan_text(session.plan()));
}

void run_list(Context& context) {
  const v1::ListSessionsResponse all = list_sessions(context.connection());
  Table table({"SESSION", "STATE", "FRAME", "TIME", "AT REST", "SHEETS"});
  for (const auto& session : all.sessions()) {
    table.add({session.name(), state_text(session.state()), std::to_string(session.frame()),
               seconds_text(session.time_s()), session.at_rest() ? "yes" : "no",
               std::to_string(session.scene().sheets_size())});
  }
  context.answer(to_json(all), all.sessions().empty() ? "no sessions\n" : table.text());
}

void run_get(Context& context, const std::string& name) {
  const v1::Session session = context.connection().get_session(context.session_name(name));
  context.answer(to_json(session), session_text(session) + plan_text(session.plan()));
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
  CLI::App* session = add_group(app, "session", "Create, show and delete sessions");

  auto create = std::make_shared<CreateOptions>();
  CLI::App* command =
      session->add_subcommand("create", "Make a session, paused at frame 0, from a scene file");
  command->add_option("FILE", create->path, "Scene file")->option_text(" ")->required();
  command->add_option("--id", create->id, "Name of the session; else the server picks one")
      ->type_name("NAME");
  command->callback([&context, create] { run_create(context, *create); });

  command = session->add_subcommand("list", "List all sessions");
  command->callback([&context] { run_list(context); });

  auto name = std::make_shared<std::string>();
  command = session->add_subcommand("get", "Show one session");
  add_session_argument(*command, *name);
  command->callback([&context, name] { run_get(context, *name); });

  auto remove = std::make_shared<DeleteOptions>();
  command = session->add_subcommand("delete", "End a session and its streams");
  add_session_argument(*command, remove->session);
  command->add_flag("--allow-missing", remove->allow_missing, "Succeed when there is none");
  command->callback([&context, remove] { run_delete(context, *remove); });
}

}  // namespace weft::client
