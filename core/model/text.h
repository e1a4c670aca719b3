#pragma once

#include <sstream>
#include <string>

namespace weft {

// The parts in a row, numbers with four digits.
template <class... Parts>
std::string join(const Parts&... parts) {
  std::ostringstream out;
  out.precision(4);
  (out << ... << parts);
  return out.str();
}

}  // namespace weft
