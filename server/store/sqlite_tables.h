#pragma once

#include <memory>
#include <string>

#include "server/store/statements.h"

namespace weft {

// Tables of assets in an SQLite file, made where it is missing; ":memory:" for none. Throws
// StoreError where it cannot be used.
std::unique_ptr<Tables> open_sqlite_tables(const std::string& path);

}  // namespace weft
