#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "client/connection.h"
#include "client/output/json.h"
#include "client/output/terminal.h"

namespace weft::client {

// What every command is given: the options that all have, a connection, and a way to answer.
class Context {
 public:
  Context(const Terminal& given_terminal, std::stop_token given_stop)
      : terminal(given_terminal), stop(std::move(given_stop)) {}

  Terminal terminal;
  std::stop_token stop;
  std::string server = kDefaultServer;
  Credentials credentials;
  bool server_named = false;  // by an option, or the environment
  bool embedded = false;
  bool json = false;

  // Opened when first asked for.
  Connection& connection();
  // "sessions/flag" of "flag". Refused where the server is our own: it has no sessions yet.
  std::string session_name(const std::string& session);
  // For what a server of our own does as well as any: unless one was named, ours.
  void prefer_embedded() { embedded = embedded || !server_named; }
  // The same, but where the server is our own, the session made from that scene file. A JSON file,
  // where no server was named, has one of its own.
  std::string session_or_scene(const std::string& given);

  // Prints the answer: the document for scripts, the text for people.
  void answer(const Json& document, const std::string& text);
  // Waits for Ctrl-C.
  void await_stop() const;

 private:
  std::unique_ptr<Connection> connection_;
};

}  // namespace weft::client
