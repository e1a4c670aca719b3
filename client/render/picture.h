#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace weft::client {

// Red, green and blue of linear light, 0 to 1.
using Colour = Eigen::Array3f;

// Of "#c8553d" in sRGB.
Colour colour_of(std::string_view hex);

// Pixels from the upper left corner, row by row, 3 bytes each.
class Picture {
 public:
  Picture(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  void set(int x, int y, const Colour& colour);
  // Covers a share of the pixel, 0 to 1. Pixels outside the picture are left out.
  void cover(int x, int y, const Colour& colour, float share);

  const std::uint8_t* bytes() const { return bytes_.data(); }

  // The file, as large as the picture at most. Throws std::runtime_error.
  std::string png() const;

 private:
  std::uint8_t* pixel(int x, int y) {
    return &bytes_[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                        static_cast<std::size_t>(x))];
  }

  int width_;
  int height_;
  std::vector<std::uint8_t> bytes_;
};

// Letters of DejaVu Sans. Sizes, from line to line, and places in pixels; text is UTF-8.
float text_width(std::string_view text, float size);
// From the left end of the base line.
void write_text(Picture& picture, std::string_view text, float size, float x, float y,
                const Colour& colour);

}  // namespace weft::client
