#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace weft::testing {

// What a network does to answers of a server.
struct NetworkFault {
  enum class End {
    kReset,    // both ends see a reset
    kCut,      // both see an orderly end
    kSwallow,  // what is sent is lost in silence for a while, then both see a reset
  };
  int breaks = 0;                     // connections that end early, each
  std::size_t after_bytes = 0;        // after so many of answers
  std::size_t after_asked_bytes = 0;  // and of requests
  End end = End::kReset;
  std::size_t slice = 4096;              // most bytes that are passed on at a time
  std::chrono::microseconds delay = {};  // before each slice
};

// A TCP relay to a server, with faults.
class BreakingProxy {
 public:
  explicit BreakingProxy(const std::string& target, NetworkFault fault = {});
  ~BreakingProxy();

  const std::string& address() const { return address_; }
  int broken() const { return broken_; }
  // What clients sent, of one after the other.
  std::string asked() const;
  // Breaks every connection and takes no more.
  void close();

 private:
  void accept_connections();
  void relay(int client);
  // Passes on what the other end sent, and counts it; false where it has ended.
  bool pass(int from, int to, bool answers, std::size_t& passed);

  std::string target_;
  std::string address_;
  const NetworkFault fault_;
  std::atomic<int> breaks_left_;
  std::atomic<int> broken_ = 0;
  std::atomic<bool> closed_ = false;
  mutable std::mutex mutex_;
  std::string asked_;
  int listener_;
  std::thread acceptor_;
  std::vector<std::thread> relays_;  // the acceptor's
};

}  // namespace weft::testing
