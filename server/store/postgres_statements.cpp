#include "server/store/postgres_statements.h"

#include <cstdint>

#include "server/store/postgres_values.h"

namespace weft {
namespace {

// As PostgreSQL writes bytes in text: libpqxx 6 binds a list of any length as texts alone.
std::string hexadecimal(const std::string& bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 + 2 * bytes.size());
  text = "\\x";
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::string text_of(const Statements::Value& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) return std::to_string(*number);
  if (const auto* string = std::get_if<std::string>(&value)) return *string;
  return hexadecimal(std::get<Statements::Bytes>(value).value);
}

Statements::Value value_of(const pqxx::field& field) {
  constexpr pqxx::oid kBytes = 17, kInt8 = 20, kInt4 = 23;  // of pg_type
  switch (field.type()) {
    case kBytes:
      return Statements::Bytes{bytes_of(field)};
    case kInt8:
    case kInt4:
      return number_of(field);
    default:
      return field.as<std::string>();
  }
}

}  // namespace

std::vector<Statements::Row> PostgresStatements::run(const std::string& text,
                                                     const std::vector<Value>& values) {
  std::vector<std::string> texts;
  for (const Value& value : values) texts.push_back(text_of(value));
  const auto result = transaction_.exec_params(text, pqxx::prepare::make_dynamic_params(texts));
  std::vector<Row> rows;
  for (const auto& found : result) {
    Row& row = rows.emplace_back();
    for (const auto& field : found) row.push_back(value_of(field));
  }
  return rows;
}

void PostgresTables::read(const Work& work) {
  connection_.run([&](pqxx::work& transaction) {
    PostgresStatements statements(transaction);
    work(statements);
  });
}

void PostgresTables::write(const Work& work) {
  connection_.run([&](pqxx::work& transaction) {
    transaction.exec("SELECT pg_advisory_xact_lock(7312)");  // one server at a time
    PostgresStatements statements(transaction);
    work(statements);
  });
}

}  // namespace weft
