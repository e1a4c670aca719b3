#include "client/output/status.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

namespace weft::client {
namespace {

// What the terminal would wrap or scroll could not be taken away again.
void fit(std::vector<std::string>& lines) {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0)
    return;
  if (size.ws_row > 2 && lines.size() >= size.ws_row) {
    lines.resize(size.ws_row - 1U);
    lines.back() = "...";
  }
  for (std::string& line : lines) {
    if (size.ws_col == 0 || line.size() <= size.ws_col) continue;
    std::size_t end = size.ws_col;
    while ((static_cast<unsigned char>(line[end]) & 0xC0U) == 0x80U) --end;  // within a character
    line.resize(end);
  }
}

}  // namespace

void Status::show(std::vector<std::string> lines) {
  const auto now = std::chrono::steady_clock::now();
  if (!watched_ || (shown_ > 0 && now - last_ < std::chrono::milliseconds(100))) return;
  clear();
  fit(lines);
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
