#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace weft {

// Statements that SQLite and PostgreSQL understand alike, in one transaction. Parameters are $1, $2
// ...
class Statements {
 public:
  struct Bytes {
    std::string value;
  };
  using Value = std::variant<std::int64_t, std::string, Bytes>;
  using Row = std::vector<Value>;

  virtual ~Statements() = default;

  // What it selects or returns.
  virtual std::vector<Row> run(const std::string& text, const std::vector<Value>& values) = 0;
};

// Tables that both have, in a schema "weft". Thread-safe.
class Tables {
 public:
  using Work = std::function<void(Statements&)>;

  virtual ~Tables() = default;

  // Carries the work out in one transaction; twice where a connection turns out to be broken.
  // Throws StoreError, and nothing is done.
  virtual void read(const Work& work) = 0;
  // The same for work that writes; one at a time, whoever else has these tables.
  virtual void write(const Work& work) = 0;
};

}  // namespace weft
