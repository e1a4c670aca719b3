#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace weft::client {

// A prepared statement. Columns and parameters are counted from 0 and 1, as SQLite does.
class Statement {
 public:
  explicit Statement(sqlite3_stmt* statement);

  Statement& bind(int index, std::int64_t value);
  Statement& bind(int index, double value);
  Statement& bind_text(int index, std::string_view text);
  // The bytes must live until the statement is reset.
  Statement& bind_bytes(int index, std::string_view bytes);

  // Moves to the next row; false after the last.
  bool step();
  // Ends the run, and with it the lock on the file.
  void reset();

  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string bytes(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

// An SQLite file. What fails is a Problem that names it.
class Database {
 public:
  enum class Access { kRead, kCreate };
  Database(const std::string& path, Access access);

  void execute(const char* sql);
  Statement prepare(std::string_view sql);

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace weft::client
