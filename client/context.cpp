#include "client/context.h"

#include <condition_variable>
#include <mutex>

#include "client/problem.h"
#include "client/scene_file.h"

namespace weft::client {

Connection& Context::connection() {
  if (!connection_)
    connection_ = embedded ? Connection::embedded(stop) : Connection::to(server, stop, credentials);
  return *connection_;
}

std::string Context::session_name(const std::string& session) {
  if (embedded) throw usage_problem("this needs a server: sessions end with an --embedded one");
  return session.starts_with("sessions/") ? session : "sessions/" + session;
}

std::string Context::session_or_scene(const std::string& given) {
  if (!embedded && !server_named && given.ends_with(".json")) {
    embedded = true;
    if (!json) terminal.err << "runs within this command: no --server was named\n";
  }
  return embedded ? create_session(connection(), read_scene(given)).name() : session_name(given);
}

void Context::answer(const Json& document, const std::string& text) {
  terminal.out << (json ? document.dump() + '\n' : text) << std::flush;
}

void Context::await_stop() const {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any().wait(lock, stop, [] { return false; });
}

}  // namespace weft::client
