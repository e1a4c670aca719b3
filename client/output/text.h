#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace weft::client {

// "31 frames", "1 frame"
std::string count_of(std::int64_t count, std::string_view thing);
// "400 us", "1.25 s"
std::string seconds_text(double seconds);
// "12.3 MB"
std::string bytes_text(std::int64_t bytes);
// "1.23 %" of a fraction
std::string percent_text(double fraction);
// Four significant digits.
std::string number_text(double number);

// Of a session or a frame's stats: " within 0.09 % of its weight" where it relaxes.
template <class Seen>
std::string residual_text(const Seen& seen) {
  return seen.has_residual() ? " within " + percent_text(seen.residual()) + " of its weight" : "";
}

// The text within 80 columns: longer lines go on below, where their last column begins.
std::string wrapped(const std::string& text);

// Label and value, one pair a line, values aligned and wrapped; a label that repeats is shown once.
class Facts {
 public:
  Facts& add(std::string label, std::string value);
  std::string text() const;

 private:
  std::vector<std::pair<std::string, std::string>> rows_;
};

// Aligned columns under a heading; cells that begin like a number stand to the right.
class Table {
 public:
  explicit Table(std::vector<std::string> heading) : rows_{std::move(heading)} {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  // Where it has more columns than a terminal, its longest names lose their middle. 0: any number.
  std::string text(std::size_t columns = 0) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace weft::client
