#pragma once

#include <cstdint>
#include <pqxx/pqxx>
#include <string>

namespace weft {

inline pqxx::binarystring binary(const std::string& bytes) { return {bytes.data(), bytes.size()}; }
inline std::string bytes_of(const pqxx::field& field) { return pqxx::binarystring(field).str(); }
inline std::int64_t number_of(const pqxx::field& field) { return field.as<std::int64_t>(); }

}  // namespace weft
