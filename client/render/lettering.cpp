#include <algorithm>
#include <cmath>

#include "client/render/picture.h"

#define STBTT_STATIC
#define STB_TRUETYPE_IMPLEMENTATION
#include <stb/stb_truetype.h>

// DejaVuSans.ttf, which travels in the binary
extern "C" const unsigned char
    _binary_DejaVuSans_ttf_start[];  // NOLINT(bugprone-reserved-identifier)

namespace weft::client {
namespace {

const stbtt_fontinfo& font() {
  static const stbtt_fontinfo loaded = [] {
    stbtt_fontinfo info{};
    stbtt_InitFont(&info, _binary_DejaVuSans_ttf_start, 0);
    return info;
  }();
  return loaded;
}

// Takes the first character away; what is no UTF-8 is taken byte by byte.
int next_character(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  const std::size_t length = first < 0xc0 ? 1 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
  unsigned character = length == 1 ? first : first & (0x7fU >> length);
  for (std::size_t i = 1; i < std::min(length, text.size()); ++i)
    character = character << 6 | (byte(i) & 0x3fU);
  text.remove_prefix(std::min(length, text.size()));
  return static_cast<int>(character);
}

// Calls draw(character, its left end) and answers the right end of all.
template <class Draw>
float set_text(std::string_view text, float scale, float x, const Draw& draw) {
  while (!text.empty()) {
    const int character = next_character(text);
    int advance = 0;
    int bearing = 0;
    stbtt_GetCodepointHMetrics(&font(), character, &advance, &bearing);
    draw(character, x);
    x += scale * static_cast<float>(advance);
  }
  return x;
}

}  // namespace

float text_width(std::string_view text, float size) {
  return set_text(text, stbtt_ScaleForPixelHeight(&font(), size), 0, [](int, float) {});
}

void write_text(Picture& picture, std::string_view text, float size, float x, float y,
                const Colour& colour) {
  const float scale = stbtt_ScaleForPixelHeight(&font(), size);
  set_text(text, scale, x, [&](int character, float left) {
    const float whole = std::floor(left);
    int width = 0;
    int height = 0;
    int dx = 0;
    int dy = 0;
    unsigned char* shares = stbtt_GetCodepointBitmapSubpixel(&font(), scale, scale, left - whole, 0,
                                                             character, &width, &height, &dx, &dy);
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        picture.cover(static_cast<int>(whole) + dx + column,
                      static_cast<int>(std::lround(y)) + dy + row, colour,
                      static_cast<float>(shares[row * width + column]) / 255);
      }
    }
    stbtt_FreeBitmap(shares, nullptr);
  });
}

}  // namespace weft::client
