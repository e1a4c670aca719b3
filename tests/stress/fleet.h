#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "client/connection.h"
#include "tests/stress/weftd.h"
#include "tests/support/service/postgres.h"
#include "tests/support/service/process.h"
#include "tests/support/temporary_directory.h"

namespace weft::stress {

// Replicas of weftd that share a PostgreSQL, behind HAProxy as docker/haproxy.cfg has it.
class Fleet {
 public:
  // All replicas serve once it is constructed. Those of old processes go on for `hard_stop` after a
  // reload of HAProxy.
  explicit Fleet(std::size_t replicas, const std::string& hard_stop = "1s");
  ~Fleet();
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  // Through HAProxy.
  std::unique_ptr<client::Connection> connect(std::stop_token stop = {}) const;
  std::string path(const std::string& name) const { return directory_.path(name); }

  std::size_t size() const { return replicas_.size(); }
  Weftd& replica(std::size_t number) { return *replicas_.at(number); }
  // As the load balancer calls it.
  static std::string name(std::size_t number);
  // Which replica has which session, by names.
  static std::map<std::string, std::string> owners(client::Connection& connection);

  testing::Postgres& database() { return *database_; }
  // How the disk of the database behaves from now on.
  void set_disk(Disk disk) const;
  // HAProxy reads its configuration again, in a new process; returns when that serves.
  void reload() const;

 private:
  void start_balancer(const std::string& hard_stop);

  testing::TemporaryDirectory directory_;
  std::optional<testing::Postgres> database_;
  std::vector<std::unique_ptr<Weftd>> replicas_;
  std::string address_;
  std::optional<testing::Process> balancer_;
};

}  // namespace weft::stress
