#include "client/recording/database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cstring>

#include "client/problem.h"

namespace weft::client {
namespace {

constexpr int kBusyTimeoutMs = 30'000;

[[noreturn]] void fail(sqlite3* database) {
  const int code = sqlite3_errcode(database) & 0xff;
  const char* file = sqlite3_db_filename(database, "main");
  const std::string path = file == nullptr ? "" : file;
  const int system_error = sqlite3_system_errno(database);
  const std::string why =
      system_error != 0 ? std::strerror(system_error) : sqlite3_errmsg(database);
  switch (code) {
    case SQLITE_NOTADB:
      throw malformed(path, "not a recording of weft");
    case SQLITE_CORRUPT:
      throw damaged(path, "it is cut short or written over; copy it again from where it was made");
    case SQLITE_FULL:
      throw unwritable(path, "the disk is full");
    case SQLITE_IOERR:
    case SQLITE_READONLY:
      throw unwritable(path, why);
    default:
      throw Problem(Exit::kFile, "INTERNAL", "FILE_ERROR", fmt::format("{}: {}", path, why));
  }
}

void check(sqlite3_stmt* statement, int code) {
  if (code != SQLITE_OK) fail(sqlite3_db_handle(statement));
}

}  // namespace

Statement::Statement(sqlite3_stmt* statement) : statement_(statement) {}

Statement& Statement::bind(int index, std::int64_t value) {
  check(statement_.get(), sqlite3_bind_int64(statement_.get(), index, value));
  return *this;
}

Statement& Statement::bind(int index, double value) {
  check(statement_.get(), sqlite3_bind_double(statement_.get(), index, value));
  return *this;
}

Statement& Statement::bind_text(int index, std::string_view text) {
  check(statement_.get(), sqlite3_bind_text64(statement_.get(), index, text.data(), text.size(),
                                              SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind_bytes(int index, std::string_view bytes) {
  check(statement_.get(),
        sqlite3_bind_blob64(statement_.get(), index, bytes.data(), bytes.size(), SQLITE_STATIC));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code != SQLITE_ROW && code != SQLITE_DONE) fail(sqlite3_db_handle(statement_.get()));
  return code == SQLITE_ROW;
}

void Statement::reset() { sqlite3_reset(statement_.get()); }

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const { return sqlite3_column_double(statement_.get(), column); }

std::string Statement::bytes(int column) const {
  const void* data = sqlite3_column_blob(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return data == nullptr ? std::string() : std::string(static_cast<const char*>(data), size);
}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Database::Database(const std::string& path, Access access) {
  // a reader may have to finish what a killed writer began, so it asks to write too
  const int flags = SQLITE_OPEN_READWRITE | (access == Access::kCreate ? SQLITE_OPEN_CREATE : 0);
  sqlite3* opened = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &opened, flags, nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) {
    const std::string why = std::strerror(sqlite3_system_errno(opened));
    throw access == Access::kCreate ? unwritable(path, why) : unreadable(path, why);
  }
  sqlite3_extended_result_codes(opened, 1);
  sqlite3_busy_timeout(opened, kBusyTimeoutMs);
  if (access == Access::kRead) execute("PRAGMA query_only = 1");
}

void Database::execute(const char* sql) {
  if (sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    fail(database_.get());
}

Statement Database::prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()), &statement,
                         nullptr) != SQLITE_OK) {
    fail(database_.get());
  }
  return Statement(statement);
}

void Database::Close::operator()(sqlite3* database) const { sqlite3_close(database); }

}  // namespace weft::client
