#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>  // which Boost.Asio needs, and does not include

namespace weft::client {

struct HttpRequest {
  std::string method;
  std::string path;  // "/recordings/start"
  std::string body;
};

struct HttpResponse {
  int status = 200;
  std::string type = "application/json";
  std::string body{};
};

// What is said on a WebSocket.
struct WebMessage {
  std::string bytes{};
  bool binary = false;
  bool last = false;  // ends the conversation
};

// A WebSocket on which the browser speaks first and every message is answered with one, so that
// nothing queues. It ends, and is destroyed, when the browser goes.
class Conversation {
 public:
  virtual ~Conversation() = default;
  virtual WebMessage answer(const std::string& said) = 0;
};

struct HttpHandlers {
  std::function<HttpResponse(const HttpRequest&)> answer;
  std::function<std::unique_ptr<Conversation>(const std::string& path)> converse;  // none: null
};

// An HTTP server for pages of its own. Handlers may block; each connection waits for its own alone.
// Refused are a request that names the server by anything but an address or localhost, which a
// foreign name might lead here, one from a page of another origin, and one of more than 64 KiB; a
// connection beyond 64 is closed.
class HttpServer {
 public:
  // Throws where it cannot listen there. Port 0: a free one.
  HttpServer(const std::string& host, std::uint16_t port, HttpHandlers handlers);
  // Waits for handlers that are at work.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  std::string address() const;  // "127.0.0.1:7312"

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace weft::client
