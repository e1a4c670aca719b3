#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/recording/frame_range.h"

namespace weft::client {

// A recording as a page shows it.
struct Exhibit {
  std::string name;                                          // above it
  std::string path;                                          // of the recording
  std::vector<std::pair<std::string, std::string>> facts{};  // to be shown before its own
};

// Recordings that are shown side by side, in step.
struct Figure {
  std::string title;    // of its button, where a page has several figures
  std::string caption;  // may be empty
  std::vector<Exhibit> exhibits;
};

struct PageOrder {
  std::string path;
  std::string title;
  std::vector<Figure> figures{};
  FrameRange frames{};                 // of every recording
  std::size_t most_bytes = 8'000'000;  // of the file, as far as less precise positions do
};

struct PageResult {
  std::int64_t frames = 0;     // of all recordings
  std::int64_t bytes = 0;      // of the file
  double largest_error_m = 0;  // of a coordinate, against the recording
};

// Writes one HTML file that plays recordings: it holds everything it needs and opens without a
// network. Recordings are read a frame at a time, several times; memory holds as much as the file.
PageResult write_page(const PageOrder& order,
                      const std::function<void(const std::string& doing)>& progress);

// The page of weft serve: it asks the server that it comes from.
std::string live_page();

// The colours of a page's numbers, from the least to the largest: "#3288bd" ...
std::vector<std::string_view> page_ramp();
// Of those around 0.
std::vector<std::string_view> page_balance();

}  // namespace weft::client
