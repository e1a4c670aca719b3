#pragma once

#include <cstdint>
#include <string>

#include "client/connection.h"
#include "client/serve/http_server.h"
#include "client/serve/recordings.h"

namespace weft::client {

struct LiveOrder {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;        // 0: a free one
  std::string recordings = ".";  // directory
};

// Serves a page that shows the sessions of a server while they run, and drives them. The page calls
// methods of the server by their paths, "/weft.v1.SessionService/PauseSession": a POST for a
// message, a WebSocket for a stream, both in protobuf JSON; a frame is binary: the length of its
// JSON (32 bits), the JSON, padded with spaces to a multiple of 4, and the positions.
class LiveServer {
 public:
  LiveServer(Connection& connection, const LiveOrder& order);

  std::string address() const { return http_.address(); }

 private:
  HttpResponse answer(const HttpRequest& request);
  std::unique_ptr<Conversation> converse(const std::string& path);

  Connection& connection_;
  Recordings recordings_;
  HttpServer http_;  // last: the others outlive its handlers
};

}  // namespace weft::client
