#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/support/service/process.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {

// A throw-away PostgreSQL on a socket in a temporary directory.
class Postgres {
 public:
  // Whether this machine has one.
  static bool is_installed();

  // Serves once constructed. Settings are "name=value", as is what is added to its environment.
  // Throws std::runtime_error where it cannot.
  explicit Postgres(std::vector<std::string> settings = {"fsync=off"},
                    std::vector<std::string> environment = {});
  ~Postgres();
  Postgres(const Postgres&) = delete;
  Postgres& operator=(const Postgres&) = delete;

  // For --database.
  std::string url() const;

  // Ends every connection, and takes none until start().
  void stop();
  void start();
  void restart() {
    stop();
    start();
  }
  // SIGSTOP and SIGCONT to it and its connections.
  void freeze() const;
  void thaw() const;

  // Processor time that it and its connections have used.
  double cpu_s() const;

 private:
  TemporaryDirectory directory_;
  std::vector<std::string> settings_, environment_;
  std::optional<Process> process_;
};

}  // namespace weft::testing
