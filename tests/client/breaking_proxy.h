#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

namespace weft::testing {

// A TCP relay to a server that breaks a number of connections, each after as many bytes of answers.
class BreakingProxy {
 public:
  BreakingProxy(const std::string& target, int breaks, std::size_t bytes_each);
  ~BreakingProxy();

  const std::string& address() const { return address_; }
  int broken() const { return broken_; }
  // Breaks every connection and takes no more.
  void close();

 private:
  void accept_connections();
  void relay(int client);

  std::string target_;
  std::string address_;
  std::atomic<int> breaks_left_;
  std::atomic<int> broken_ = 0;
  std::size_t bytes_each_;
  std::atomic<bool> closed_ = false;
  int listener_;
  std::thread acceptor_;
  std::vector<std::thread> relays_;  // the acceptor's
};

}  // namespace weft::testing
