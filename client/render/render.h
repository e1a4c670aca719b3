#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "client/render/camera.h"
#include "client/render/stage.h"

namespace weft::client {

// Of a picture, pixels.
struct Size {
  int width = 0, height = 0;
};
inline constexpr int kLeastSide = 64;  // of each of the frames in a picture too
inline constexpr int kMostSide = 8192;
inline constexpr int kMostFramesShown = 64;  // of a recording

// Frames of recordings in one picture, through one camera and in one scale. Frames of one recording
// stand in lines; of several recordings each has a line, or, with one frame each, a column.
struct RenderOrder {
  std::string path;
  std::vector<std::string> recordings;
  std::vector<std::int64_t> frames;  // none: the last
  int contact = 0;    // instead, so many from first to last; what ended earlier shows its last
  int turntable = 0;  // so many views, once around, of one frame each, as an animation
  std::optional<Size> size;
  Outlook outlook;
  Colouring colouring = Colouring::kCloth;
};

// How the values of a colouring are labelled.
struct ColourScale {
  const char* name;
  const char* title;  // in a picture
  const char* field;  // the largest, in JSON
  std::string (*text)(double value);
  bool balanced = false;  // around 0, else from 0 on
};
// None of cloth and panels.
const ColourScale* scale_of(Colouring colouring);

struct RenderResult {
  Size size;
  std::vector<std::vector<std::int64_t>> frames;  // of each recording
  int views = 1;
  double most = 0;    // of the colouring
  double grid_m = 0;  // cells on the ground
};

bool ends_with_webp(const std::string& path);

// Writes the picture as a PNG, or as WebP where the path ends so, as an animation does; equal
// recordings give equal bytes on one machine. Holds a frame at a time, and the picture twice: 400
// MB at most, beside a frame.
RenderResult render(const RenderOrder& order,
                    const std::function<void(const std::string& doing)>& progress,
                    const std::stop_token& stop);

}  // namespace weft::client
