#include "client/context.h"

#include "client/scene_file.h"

namespace weft::client {

Connection& Context::connection() {
  if (!connection_)
    connection_ = embedded ? Connection::embedded(stop) : Connection::to(server, stop);
  return *connection_;
}

std::string Context::session_name(const std::string& session) {
  if (!embedded) return session.starts_with("sessions/") ? session : "sessions/" + session;
  return create_session(connection(), session).name();
}

void Context::answer(const Json& document, const std::string& text) {
  terminal.out << (json ? document.dump() + '\n' : text) << std::flush;
}

}  // namespace weft::client
