#include "client/serve/http_server.h"

#include <fmt/format.h>

#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <chrono>
#include <optional>
#include <utility>

#include "client/problem.h"

namespace weft::client {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr int kMostConnections = 64;
constexpr std::size_t kMostBytes = 64 * 1024;  // of a request or message
constexpr std::uint32_t kMostHeaderBytes = 16 * 1024;
constexpr std::chrono::seconds kBrowserPatience{
    30};  // with a browser that is silent or does not read

// No script from elsewhere, no frame around the page, no guesses at types.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

std::string text_of(beast::string_view view) { return {view.data(), view.size()}; }

// Whether the name in "127.0.0.1:7312", "[::1]:7312" or "localhost:7312" is no other than that.
bool is_address(const std::string& host) {
  const bool bracketed = host.starts_with('[');
  const std::string name =
      bracketed ? host.substr(1, host.find(']') - 1) : host.substr(0, host.find(':'));
  error_code error;
  asio::ip::make_address(name, error);
  return name == "localhost" || !error;
}

// Whether the request comes from a page of this server, or from no page.
bool is_ours(const http::request<http::string_body>& request) {
  const std::string host = text_of(request[http::field::host]);
  const auto origin = request.find(http::field::origin);
  return is_address(host) &&
         (origin == request.end() || text_of(origin->value()) == "http://" + host);
}

HttpResponse plain(int status, const std::string& text) {
  return {.status = status, .type = "text/plain", .body = text + '\n'};
}

// One connection: requests one after the other, until it becomes a WebSocket or ends.
class Peer : public std::enable_shared_from_this<Peer> {
 public:
  Peer(tcp::socket socket, const HttpHandlers& handlers, std::atomic<int>& count)
      : stream_(std::move(socket)), handlers_(handlers), count_(count) {}
  ~Peer() { --count_; }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeaderBytes);
    parser_->body_limit(kMostBytes);
    stream_.expires_after(kBrowserPatience);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->on_read(error); });
  }

 private:
  void on_read(error_code error) {
    if (error == http::error::body_limit)
      return respond(plain(413, fmt::format("a request has at most {} bytes", kMostBytes)), false);
    if (error == http::error::header_limit)
      return respond(plain(431, "the request's header is too long"), false);
    if (error) return;
    const http::request<http::string_body> request = parser_->release();
    if (!is_ours(request)) {
      return respond(plain(403, "only pages of this server may ask, at its address or localhost"),
                     false);
    }
    if (websocket::is_upgrade(request)) return converse(request);
    respond(answer(request), request.keep_alive() && request.method() != http::verb::head);
  }

  HttpResponse answer(const http::request<http::string_body>& request) try {
    return handlers_.answer(
        {text_of(request.method_string()), text_of(request.target()), request.body()});
  } catch (const std::exception& error) {
    return plain(500, error.what());
  }

  void respond(HttpResponse response, bool keep_alive) {
    const bool is_page = response.type.starts_with("text/html");
    response_ = {static_cast<http::status>(response.status), 11, std::move(response.body)};
    response_.set(http::field::content_type, response.type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("X-Content-Type-Options", "nosniff");
    if (is_page) response_.set("Content-Security-Policy", kPolicy);
    response_.keep_alive(keep_alive);
    response_.prepare_payload();
    stream_.expires_after(kBrowserPatience);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](error_code error, std::size_t) {
                        if (!error && self->response_.keep_alive()) return self->read();
                        self->stream_.socket().shutdown(tcp::socket::shutdown_send, error);
                      });
  }

  void converse(const http::request<http::string_body>& request) {
    try {
      conversation_ = handlers_.converse(text_of(request.target()));
    } catch (const std::exception& error) {
      return respond(plain(500, error.what()), false);
    }
    if (!conversation_) return respond(plain(404, "there is no such stream"), false);
    stream_.expires_never();  // the WebSocket has timeouts of its own
    socket_.emplace(std::move(stream_));
    socket_->set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_->read_message_max(kMostBytes);
    socket_->async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) self->listen();
    });
  }

  void listen() {
    buffer_.clear();
    socket_->async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->on_said();
    });
  }

  void on_said() {
    try {
      message_ = conversation_->answer(beast::buffers_to_string(buffer_.data()));
    } catch (const std::exception& error) {
      message_ = {.bytes = error.what(), .last = true};
    }
    socket_->binary(message_.binary);
    socket_->async_write(
        asio::buffer(message_.bytes), [self = shared_from_this()](error_code error, std::size_t) {
          if (error) return;
          if (!self->message_.last) return self->listen();
          self->socket_->async_close(websocket::close_code::normal, [self](error_code) {});
        });
  }

  beast::tcp_stream stream_;
  const HttpHandlers& handlers_;
  std::atomic<int>& count_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
  std::optional<websocket::stream<beast::tcp_stream>> socket_;
  std::unique_ptr<Conversation> conversation_;
  WebMessage message_;
};

tcp::endpoint endpoint_of(const std::string& host, std::uint16_t port) {
  error_code error;
  const auto address = asio::ip::make_address(host == "localhost" ? "127.0.0.1" : host, error);
  if (error) throw usage_problem(fmt::format("{} is not an address such as 127.0.0.1", host));
  return {address, port};
}

}  // namespace

class HttpServer::Listener {
 public:
  Listener(const tcp::endpoint& endpoint, HttpHandlers handlers)
      : handlers_(std::move(handlers)), acceptor_(threads_, endpoint) {
    accept();
  }
  ~Listener() {
    threads_.stop();
    threads_.join();
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  tcp::endpoint endpoint() const { return acceptor_.local_endpoint(); }

 private:
  void accept() {
    acceptor_.async_accept(asio::make_strand(threads_),
                           [this](error_code error, tcp::socket socket) {
                             if (error == asio::error::operation_aborted) return;
                             if (!error && ++count_ <= kMostConnections) {
                               socket.set_option(tcp::no_delay(true), error);
                               std::make_shared<Peer>(std::move(socket), handlers_, count_)->read();
                             } else if (!error) {
                               --count_;
                             }
                             accept();
                           });
  }

  const HttpHandlers handlers_;
  std::atomic<int> count_ = 0;
  asio::thread_pool threads_{kMostConnections + 1};  // one for each, and one that accepts
  tcp::acceptor acceptor_;
};

HttpServer::HttpServer(const std::string& host, std::uint16_t port, HttpHandlers handlers) try
    : listener_(std::make_unique<Listener>(endpoint_of(host, port), std::move(handlers))) {
} catch (const boost::system::system_error& error) {
  throw Problem(Exit::kRefused, "UNAVAILABLE", "ADDRESS_UNUSABLE",
                fmt::format("cannot listen on {}:{}: {}; choose another --http", host, port,
                            error.code().message()));
}

HttpServer::~HttpServer() = default;

std::string HttpServer::address() const {
  const tcp::endpoint endpoint = listener_->endpoint();
  const std::string host = endpoint.address().to_string();
  return fmt::format("{}:{}", endpoint.address().is_v6() ? "[" + host + "]" : host,
                     endpoint.port());
}

}  // namespace weft::client
