#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "client/connection.h"
#include "tests/stress/disk/disk.h"
#include "tests/support/service/process.h"
#include "tests/support/temporary_directory.h"

namespace weft::stress {

// What a process uses now, as the kernel counts it.
struct Usage {
  double cpu_s = 0;              // so far
  std::int64_t memory = 0;       // bytes resident
  std::int64_t most_memory = 0;  // so far
  std::int64_t stored = 0;       // bytes that went to disk so far
  int threads = 0;
  int files = 0;
};

// A weftd with a data directory, on a loopback address of this process, so that its port stays free
// while it is gone.
class Weftd {
 public:
  explicit Weftd(std::vector<std::string> flags = {});
  ~Weftd();  // kills it
  Weftd(const Weftd&) = delete;
  Weftd& operator=(const Weftd&) = delete;

  std::string address() const { return host_ + ":" + port_; }
  std::unique_ptr<client::Connection> connect(std::stop_token stop = {}) const;
  std::string path(const std::string& name) const { return directory_.path(name); }
  Usage usage() const;

  void kill();
  void start();
  void kill_and_start() {
    kill();
    start();
  }
  // It stands still: SIGSTOP.
  void freeze() const;
  void thaw() const;
  // How its disk behaves from now on.
  void set_disk(Disk disk) const;
  // Its exit code.
  int terminate();

 private:
  testing::TemporaryDirectory directory_;
  std::vector<std::string> flags_;
  std::string host_;
  std::string port_ = "0";
  std::unique_ptr<testing::Process> process_;
};

}  // namespace weft::stress
