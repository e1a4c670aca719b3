#pragma once

#include <ostream>

namespace weft::client {

// Where a command writes, and whether a person watches there.
struct Terminal {
  std::ostream& out;
  std::ostream& err;
  bool out_is_watched = false;
  bool err_is_watched = false;
};

}  // namespace weft::client
