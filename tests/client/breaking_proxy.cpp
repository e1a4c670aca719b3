#include "tests/client/breaking_proxy.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <thread>

namespace weft::testing {
namespace {

constexpr int kPollMs = 20;  // how soon a close is noticed
constexpr std::chrono::milliseconds kSwallowing{60};

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int port_of(const std::string& address) {
  return std::stoi(address.substr(address.rfind(':') + 1));
}

int open_socket() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) throw std::runtime_error("no socket");
  return socket;
}

bool send_all(int socket, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t sent = ::send(socket, bytes, size, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

// Without a farewell: the peer sees a reset.
void reset(int socket) {
  const linger hard{.l_onoff = 1, .l_linger = 0};
  ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &hard, sizeof(hard));
  ::close(socket);
}

}  // namespace

BreakingProxy::BreakingProxy(const std::string& target, NetworkFault fault)
    : target_(target), fault_(fault), breaks_left_(fault.breaks), listener_(open_socket()) {
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof(address);
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::listen(listener_, 16) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no port for the proxy");
  }
  address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  acceptor_ = std::thread([this] { accept_connections(); });
}

BreakingProxy::~BreakingProxy() { close(); }

std::string BreakingProxy::asked() const {
  const std::lock_guard lock(mutex_);
  return asked_;
}

void BreakingProxy::close() {
  closed_ = true;
  if (acceptor_.joinable()) acceptor_.join();
}

void BreakingProxy::accept_connections() {
  while (!closed_) {
    pollfd waiting{.fd = listener_, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, kPollMs) <= 0) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client >= 0) relays_.emplace_back([this, client] { relay(client); });
  }
  ::close(listener_);
  for (auto& relay : relays_) relay.join();
}

bool BreakingProxy::pass(int from, int to, bool answers, std::size_t& passed) {
  std::array<char, 4096> buffer{};
  const ssize_t received = ::recv(from, buffer.data(), buffer.size(), 0);
  if (received <= 0) return false;
  const auto size = static_cast<std::size_t>(received);
  passed += size;
  if (!answers) {
    const std::lock_guard lock(mutex_);
    asked_.append(buffer.data(), size);
    return send_all(to, buffer.data(), size);
  }
  for (std::size_t begin = 0; begin < size; begin += fault_.slice) {
    if (fault_.delay.count() > 0) std::this_thread::sleep_for(fault_.delay);
    if (!send_all(to, buffer.data() + begin, std::min(fault_.slice, size - begin))) return false;
  }
  return true;
}

void BreakingProxy::relay(int client) {
  const int server = open_socket();
  const int at_once = 1;
  ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof(at_once));
  const sockaddr_in address = loopback(port_of(target_));
  bool open = ::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  const bool breaks = breaks_left_-- > 0;
  bool broken = false;
  std::array<std::size_t, 2> passed{};  // of requests, of answers
  std::array<pollfd, 2> ends{pollfd{client, POLLIN, 0}, pollfd{server, POLLIN, 0}};
  while (open && !closed_) {
    ::poll(ends.data(), ends.size(), kPollMs);
    for (std::size_t i = 0; i < ends.size() && open; ++i)
      if (ends[i].revents != 0) open = pass(ends[i].fd, ends[1 - i].fd, i == 1, passed[i]);
    broken = breaks && passed[0] > fault_.after_asked_bytes && passed[1] > fault_.after_bytes;
    open = open && !broken;
  }
  if (broken) ++broken_;
  if (broken && fault_.end == NetworkFault::End::kSwallow) std::this_thread::sleep_for(kSwallowing);
  const bool orderly = broken && fault_.end == NetworkFault::End::kCut;
  for (const int end : {client, server}) orderly ? void(::close(end)) : reset(end);
}

}  // namespace weft::testing
