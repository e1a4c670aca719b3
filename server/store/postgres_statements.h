#pragma once

#include <pqxx/pqxx>
#include <string>
#include <utility>
#include <vector>

#include "server/store/postgres_connection.h"
#include "server/store/statements.h"

namespace weft {

// Those of a transaction under way.
class PostgresStatements final : public Statements {
 public:
  explicit PostgresStatements(pqxx::work& transaction) : transaction_(transaction) {}

  std::vector<Row> run(const std::string& text, const std::vector<Value>& values) override;

 private:
  pqxx::work& transaction_;
};

// Tables that several servers share.
class PostgresTables final : public Tables {
 public:
  explicit PostgresTables(const std::string& url) : connection_(url) {}

  void read(const Work& work) override;
  void write(const Work& work) override;

 private:
  PostgresConnection connection_;
};

}  // namespace weft
