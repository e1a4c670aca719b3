#include "client/output/status.h"

#include <algorithm>
#include <cmath>

namespace weft::client {

void Status::show(const std::vector<std::string>& lines) {
  const auto now = std::chrono::steady_clock::now();
  if (!watched_ || (shown_ > 0 && now - last_ < std::chrono::milliseconds(100))) return;
  clear();
  for (const auto& line : lines) out_ << line << '\n';
  out_ << std::flush;
  shown_ = lines.size();
  last_ = now;
}

void Status::clear() {
  if (shown_ == 0) return;
  out_ << "\x1b[" << shown_ << "F\x1b[J" << std::flush;  // up, and erase to the end
  shown_ = 0;
}

std::string bar(double fraction) {
  constexpr int kWidth = 20;
  const auto full = static_cast<std::size_t>(std::lround(kWidth * std::clamp(fraction, 0.0, 1.0)));
  return '[' + std::string(full, '#') + std::string(kWidth - full, '.') + ']';
}

}  // namespace weft::client
