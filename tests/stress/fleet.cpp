#include "tests/stress/fleet.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "client/commands/commands.h"

namespace weft::stress {
namespace {

namespace fs = std::filesystem;

// An address of this host at which nobody listens now.
std::string free_address(const std::string& host) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  const bool bound = ::bind(socket, any, size) == 0 && ::getsockname(socket, any, &size) == 0;
  ::close(socket);
  if (!bound) throw std::runtime_error("no free port");
  return fmt::format("{}:{}", host, ntohs(address.sin_port));
}

}  // namespace

Fleet::Fleet(std::size_t replicas, const std::string& hard_stop) {
  // others than the owner, as whom PostgreSQL runs, are to read both
  fs::permissions(directory_.name(), fs::perms::others_exec | fs::perms::others_read,
                  fs::perm_options::add);
  fs::copy_file(WEFT_BAD_DISK_LIBRARY, path("bad-disk.so"));
  std::ofstream(path("disk")) << static_cast<char>(Disk::kGood);
  database_.emplace(std::vector<std::string>{"fsync=off"},
                    std::vector<std::string>{"LD_PRELOAD=" + path("bad-disk.so"),
                                             "WEFT_BAD_DISK=" + path("disk")});
  for (std::size_t number = 0; number < replicas; ++number) {
    replicas_.push_back(std::make_unique<Weftd>(
        std::vector<std::string>{"--database", database_->url(), "--replica", name(number),
                                 "--snapshot-ms", "20", "--history-bytes", "1048576"}));
  }
  start_balancer(hard_stop);
}

Fleet::~Fleet() {
  balancer_->signal(SIGTERM);
  balancer_->wait();
}

std::string Fleet::name(std::size_t number) { return fmt::format("weftd-{}", number + 1); }

std::unique_ptr<client::Connection> Fleet::connect(std::stop_token stop) const {
  return client::Connection::to(address_, std::move(stop));
}

std::map<std::string, std::string> Fleet::owners(client::Connection& connection) {
  std::map<std::string, std::string> owners;
  const v1::ListSessionsResponse all = client::list_sessions(connection);
  for (const v1::Session& session : all.sessions()) owners[session.name()] = session.replica();
  return owners;
}

void Fleet::set_disk(Disk disk) const {
  std::ofstream(path("disk"), std::ios::in) << static_cast<char>(disk);
}

void Fleet::start_balancer(const std::string& hard_stop) {
  const std::string first = replicas_.front()->address();
  const std::string host = first.substr(0, first.rfind(':'));
  address_ = free_address(host);
  std::vector<std::string> environment{
      "LISTEN=" + address_,        "METRICS=" + free_address(host), "PEER=" + free_address(host),
      "SOCKET=" + path("haproxy"), "HARD_STOP=" + hard_stop,        "MAXCONN=4000"};
  for (std::size_t number = 0; number < 8; ++number) {
    const bool exists = number < replicas_.size();
    environment.push_back(fmt::format("WEFTD_{}={}", number + 1,
                                      exists ? replicas_[number]->address() : host + ":1"));
  }
  balancer_.emplace("/usr/sbin/haproxy",
                    std::vector<std::string>{"-W", "-f", WEFT_HAPROXY_CONFIGURATION},
                    path("haproxy.txt"), 0, environment);
  connect()->await_server(std::chrono::seconds(60));
}

void Fleet::reload() const {
  const auto size = fs::file_size(path("haproxy.txt"));
  balancer_->signal(SIGUSR2);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (std::string said; said.find("Loading success") == std::string::npos;) {
    if (std::chrono::steady_clock::now() > end)
      throw std::runtime_error("HAProxy does not load: " + said);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::ifstream output(path("haproxy.txt"));
    output.seekg(static_cast<std::streamoff>(size));
    std::getline(output, said, '\0');
  }
}

}  // namespace weft::stress
