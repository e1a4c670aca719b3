#pragma once

#include <charconv>
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

// All digits that it takes, so that who reads a bound can give it.
inline std::string exact(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, end};
}

}  // namespace weft
