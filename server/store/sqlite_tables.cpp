#include "server/store/sqlite_tables.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>
#include <sqlite3.h>

#include <mutex>
#include <utility>

#include "server/store/store.h"

namespace weft {
namespace {

constexpr int kAssetsId = 0x57454641;  // "WEFA"
constexpr int kAssetsVersion = 1;      // user_version of the file
constexpr const char* kAssetTables = R"(
  CREATE TABLE weft.asset (
    hash TEXT NOT NULL,           -- SHA-256 of the bytes, 64 hexadecimal digits
    principal TEXT NOT NULL,      -- whose it is
    size INTEGER NOT NULL,        -- bytes in all
    received INTEGER NOT NULL,    -- bytes that are there
    content TEXT NOT NULL,        -- of the pieces
    made INTEGER NOT NULL,        -- when it became whole, us since 1970; 0: it is not
    facts BLOB NOT NULL,          -- weft.v1.MeshFacts of a whole one
    unused_since INTEGER NOT NULL,  -- us since 1970
    PRIMARY KEY (hash, principal));
  CREATE INDEX weft.asset_content ON asset (content);
  CREATE TABLE weft.asset_piece (
    content TEXT NOT NULL,
    number INTEGER NOT NULL,      -- 0, 1, 2 ... of 1 MiB each but the last
    data BLOB NOT NULL,
    PRIMARY KEY (content, number));
  CREATE TABLE weft.asset_use (
    uid TEXT NOT NULL,            -- of a session
    hash TEXT NOT NULL,
    principal TEXT NOT NULL,      -- whose session it is
    PRIMARY KEY (uid, hash),
    FOREIGN KEY (hash, principal) REFERENCES asset);
  CREATE INDEX weft.asset_used ON asset_use (hash, principal);
)";

class SqliteStatements final : public Statements {
 public:
  explicit SqliteStatements(SQLite::Database& database) : database_(database) {}

  std::vector<Row> run(const std::string& text, const std::vector<Value>& values) override {
    SQLite::Statement statement(database_, text);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::string name = "$" + std::to_string(i + 1);
      if (const auto* number = std::get_if<std::int64_t>(&values[i])) {
        statement.bind(name, *number);
      } else if (const auto* string = std::get_if<std::string>(&values[i])) {
        statement.bind(name, *string);
      } else {
        const std::string& bytes = std::get<Bytes>(values[i]).value;
        statement.bind(name, bytes.data(), static_cast<int>(bytes.size()));
      }
    }
    std::vector<Row> rows;
    while (statement.executeStep()) {
      Row& row = rows.emplace_back();
      for (int i = 0; i < statement.getColumnCount(); ++i) row.push_back(value(statement, i));
    }
    return rows;
  }

 private:
  static Value value(SQLite::Statement& statement, int index) {
    const SQLite::Column column = statement.getColumn(index);
    if (column.isInteger()) return column.getInt64();
    if (column.isText()) return column.getString();
    return Bytes{
        {static_cast<const char*>(column.getBlob()), static_cast<std::size_t>(column.getBytes())}};
  }

  SQLite::Database& database_;
};

class SqliteTables final : public Tables {
 public:
  explicit SqliteTables(std::string path)
      : path_(std::move(path)),
        database_(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE) {
    try {
      open();
    } catch (const SQLite::Exception& error) {
      throw StoreError(path_ + ": " + error.what());
    }
  }

  void read(const Work& work) override { write(work); }
  void write(const Work& work) override {
    std::lock_guard lock(mutex_);
    try {
      SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
      SqliteStatements statements(database_);
      work(statements);
      transaction.commit();
    } catch (const SQLite::Exception& error) {
      const bool full = error.getErrorCode() == SQLITE_FULL;
      throw StoreError(path_ + ": " + (full ? "the disk is full" : error.what()));
    }
  }

 private:
  void open() {
    SQLite::Statement attach(database_, "ATTACH $1 AS weft");
    attach.bind("$1", path_);
    attach.exec();
    database_.exec("PRAGMA weft.auto_vacuum = FULL");  // what is deleted frees the disk
    // one process at a time; every commit reaches the disk
    database_.exec("PRAGMA weft.locking_mode = EXCLUSIVE");
    database_.exec("PRAGMA weft.journal_mode = WAL");
    database_.exec("PRAGMA weft.synchronous = FULL");
    database_.exec("PRAGMA foreign_keys = ON");
    database_.exec("BEGIN EXCLUSIVE");
    const int application = database_.execAndGet("PRAGMA weft.application_id").getInt();
    const int version = database_.execAndGet("PRAGMA weft.user_version").getInt();
    if (application == 0 && version == 0) {
      database_.exec(kAssetTables);
      database_.exec("PRAGMA weft.application_id = " + std::to_string(kAssetsId));
      database_.exec("PRAGMA weft.user_version = " + std::to_string(kAssetsVersion));
    } else if (application != kAssetsId) {
      throw StoreError(path_ + " holds no assets of weftd");
    } else if (version != kAssetsVersion) {
      throw StoreError(path_ + " was made by another version of weftd");
    }
    database_.exec("COMMIT");
  }

  const std::string path_;
  std::mutex mutex_;
  SQLite::Database database_;  // guarded by mutex_
};

}  // namespace

std::unique_ptr<Tables> open_sqlite_tables(const std::string& path) {
  return std::make_unique<SqliteTables>(path);
}

}  // namespace weft
