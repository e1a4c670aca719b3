#pragma once

#include <cstddef>
#include <ostream>

namespace weft::client {

// Where a command writes, and whether a person watches there.
struct Terminal {
  std::ostream& out;
  std::ostream& err;
  bool out_is_watched = false;
  bool err_is_watched = false;
  std::size_t columns = 0;  // of out where it is watched; 0: any number
};

}  // namespace weft::client
