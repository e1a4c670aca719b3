#include "server/store/postgres_connection.h"

#include <libpq-fe.h>

#include <map>
#include <utility>

namespace weft {
namespace {

// A peer that died without a word is noticed after some ten seconds.
const std::map<std::string, std::string> kDefaults = {
    {"application_name", "weftd"}, {"connect_timeout", "5"},
    {"keepalives_idle", "5"},      {"keepalives_interval", "2"},
    {"keepalives_count", "3"},     {"tcp_user_timeout", "10000"},
    {"client_encoding", "UTF8"},   {"options", "-c client_min_messages=warning"}};

std::map<std::string, std::string> read(const std::string& url) {
  char* error = nullptr;
  PQconninfoOption* options = PQconninfoParse(url.c_str(), &error);
  if (options == nullptr) {
    std::string why = error == nullptr ? "out of memory" : error;
    PQfreemem(error);
    why.erase(why.find_last_not_of(" \n") + 1);
    throw StoreError("this names no PostgreSQL database: " + why);
  }
  auto settings = kDefaults;
  for (const auto* option = options; option->keyword != nullptr; ++option)
    if (option->val != nullptr) settings[option->keyword] = option->val;
  PQconninfoFree(options);
  return settings;
}

std::string quoted(const std::string& value) {
  std::string text = "'";
  for (const char c : value) {
    if (c == '\'' || c == '\\') text += '\\';
    text += c;
  }
  return text + "'";
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

// What the server says when it goes down or comes up, or when this process stood still for too
// long, rather than of the work.
bool is_going(const pqxx::sql_error& error) {
  const std::string& state = error.sqlstate();
  return state.starts_with("57P") || state.starts_with("08") || state == "25P03";
}

}  // namespace

PostgresConnection::PostgresConnection(const std::string& url, std::vector<Statement> statements)
    : statements_(std::move(statements)) {
  const auto settings = read(url);
  for (const auto& [name, value] : settings) settings_ += name + "=" + quoted(value) + " ";
  const auto value = [&](const char* name, const char* otherwise) {
    const auto found = settings.find(name);
    return found == settings.end() ? std::string(otherwise) : found->second;
  };
  place_ = "PostgreSQL at " + value("host", "this machine") + ":" + value("port", "5432") + "/" +
           value("dbname", "");
}

void PostgresConnection::connect() {
  connection_ = std::make_unique<pqxx::connection>(settings_);
  connection_->set_variable("idle_in_transaction_session_timeout",
                            std::to_string(kIdleInTransaction.count()));
  for (const auto& [name, text] : statements_) connection_->prepare(name, text);
  is_new_ = true;
}

bool PostgresConnection::is_new() {
  std::lock_guard lock(mutex_);
  return std::exchange(is_new_, false);
}

void PostgresConnection::run(const Work& work) {
  std::lock_guard lock(mutex_);
  const auto lost = [&](const std::exception& error) {
    connection_.reset();
    return StoreLost(place_ + " cannot be reached: " + first_line(error.what()));
  };
  for (bool again = connection_ != nullptr;; again = false) try {
      if (!connection_) connect();
      pqxx::work transaction(*connection_);
      work(transaction);
      transaction.commit();
      return;
    } catch (const pqxx::sql_error& error) {
      const bool open = connection_->is_open();
      if (open && !is_going(error)) throw StoreError(place_ + ": " + first_line(error.what()));
      const StoreLost why = lost(error);
      if (!again) throw why;
    } catch (const pqxx::failure& error) {  // broken, or in doubt
      const StoreLost why = lost(error);
      if (!again) throw why;
    }
}

}  // namespace weft
