#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <pqxx/pqxx>
#include <string>
#include <vector>

#include "server/store/store.h"

namespace weft {

// The database cannot be reached now, or went away before it said what became of the work.
class StoreLost : public StoreError {
 public:
  using StoreError::StoreError;
};

// A connection to a PostgreSQL database, made when it is needed and made anew when it broke. One
// thread at a time works on it. Thread-safe.
class PostgresConnection {
 public:
  // A statement that is prepared under a name.
  struct Statement {
    const char* name;
    const char* text;
  };

  // Throws StoreError where the URL is none.
  explicit PostgresConnection(const std::string& url, std::vector<Statement> statements = {});

  // How long a process may stand still within a transaction: then it loses the connection, and
  // others the wait for what it had locked.
  static constexpr std::chrono::milliseconds kIdleInTransaction{2000};

  // Carries the work out in one transaction, twice where an old connection turns out to be broken.
  // Throws StoreLost; StoreError where the database refuses it, and nothing is done.
  using Work = std::function<void(pqxx::work& transaction)>;
  void run(const Work& work);

  // For people: "PostgreSQL at HOST:PORT/DATABASE".
  const std::string& place() const { return place_; }
  // Whether the connection is another one than when it was asked last.
  bool is_new();

 private:
  void connect();

  std::string settings_;  // of libpq, with passwords
  std::string place_;
  const std::vector<Statement> statements_;
  std::mutex mutex_;  // guards all below
  std::unique_ptr<pqxx::connection> connection_;
  bool is_new_ = false;
};

}  // namespace weft
