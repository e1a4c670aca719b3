#include "client/output/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>
#include <sstream>

namespace weft::client {
namespace {

bool is_number_like(std::string_view cell) {
  const std::size_t first = cell.find_first_not_of("-+");
  return first != std::string_view::npos &&
         std::isdigit(static_cast<unsigned char>(cell[first])) != 0;
}

std::string without_trailing_spaces(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

// "sessions/a-ver...-long-name"; width is at least 3.
std::string shortened(const std::string& cell, std::size_t width) {
  if (cell.size() <= width) return cell;
  const std::size_t kept = width - 3, end = kept / 2;
  return cell.substr(0, kept - end) + "..." + cell.substr(cell.size() - end);
}

}  // namespace

std::string count_of(std::int64_t count, std::string_view thing) {
  return fmt::format("{} {}{}", count, thing, count == 1 ? "" : "s");
}

std::string seconds_text(double seconds) {
  if (seconds != 0 && seconds < 1e-3) return fmt::format("{:.4g} us", seconds * 1e6);
  if (seconds != 0 && seconds < 1) return fmt::format("{:.4g} ms", seconds * 1e3);
  return fmt::format("{:.4g} s", seconds);
}

std::string bytes_text(std::int64_t bytes) {
  constexpr std::array kUnits{"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  auto amount = static_cast<double>(bytes);
  while (amount >= 999.5 && unit + 1 < kUnits.size()) {
    amount /= 1000;
    ++unit;
  }
  return fmt::format("{:.3g} {}", amount, kUnits[unit]);
}

std::string percent_text(double fraction) { return fmt::format("{:.3g} %", fraction * 100); }

std::string number_text(double number) { return fmt::format("{:.4g}", number); }

std::string wrapped(const std::string& text) {
  constexpr std::size_t kLine = 80;
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    while (line.size() > kLine) {
      const std::size_t gap = line.rfind("  ", kLine);
      const std::size_t margin = line.find_first_not_of(' ', gap == std::string::npos ? 0 : gap);
      const std::size_t end = line.rfind(' ', kLine);
      if (end == std::string::npos || end <= margin) break;  // a long word
      result += line.substr(0, end) + '\n';
      line = std::string(margin, ' ') + line.substr(end + 1);
    }
    result += line + '\n';
  }
  return result;
}

Facts& Facts::add(std::string label, std::string value) {
  rows_.emplace_back(std::move(label), std::move(value));
  return *this;
}

std::string Facts::text() const {
  std::size_t width = 0;
  for (const auto& row : rows_) width = std::max(width, row.first.size());
  std::string text;
  std::string_view previous;
  for (const auto& [label, value] : rows_) {
    const auto shown = label == previous ? std::string_view() : std::string_view(label);
    text += without_trailing_spaces(fmt::format("{:{}}  {}", shown, width, value)) + '\n';
    previous = label;
  }
  return wrapped(text);
}

std::string Table::text(std::size_t columns) const {
  std::vector<std::size_t> widths(rows_.front().size());
  std::vector<bool> right(widths.size(), rows_.size() > 1);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < widths.size(); ++c) {
      widths[c] = std::max(widths[c], rows_[r][c].size());
      right[c] = right[c] && (r == 0 || is_number_like(rows_[r][c]));
    }
  }
  // the widest gives way, down to 8
  const std::size_t all = std::accumulate(widths.begin(), widths.end(), 2 * (widths.size() - 1));
  const auto widest = std::max_element(widths.begin(), widths.end());
  const std::size_t spare = *widest - std::min<std::size_t>(*widest, 8);
  if (columns > 0 && all > columns) *widest -= std::min(all - columns, spare);
  std::string text;
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t c = 0; c < widths.size(); ++c) {
      if (c > 0) line += "  ";
      const std::string cell = shortened(row[c], widths[c]);
      line += right[c] ? fmt::format("{:>{}}", cell, widths[c])
                       : fmt::format("{:<{}}", cell, widths[c]);
    }
    text += without_trailing_spaces(std::move(line)) + '\n';
  }
  return text;
}

}  // namespace weft::client
