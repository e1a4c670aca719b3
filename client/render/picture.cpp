#include "client/render/picture.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace weft::client {
namespace {

// IEC 61966-2-1
float linear_of(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

float encoded_of(float linear) {
  return linear <= 0.0031308F ? linear * 12.92F : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
}

std::array<float, 3> bytes_of(const Colour& colour) {
  std::array<float, 3> bytes{};
  for (std::size_t i = 0; i < 3; ++i)
    bytes[i] = 255 * encoded_of(std::clamp(colour[static_cast<Eigen::Index>(i)], 0.0F, 1.0F));
  return bytes;
}

std::uint8_t rounded(float value) { return static_cast<std::uint8_t>(std::lround(value)); }

}  // namespace

Colour colour_of(std::string_view hex) {
  Colour colour;
  for (std::size_t i = 0; i < 3; ++i) {
    int value = 0;
    std::from_chars(hex.data() + 1 + 2 * i, hex.data() + 3 + 2 * i, value, 16);
    colour[static_cast<Eigen::Index>(i)] = linear_of(static_cast<float>(value) / 255);
  }
  return colour;
}

Picture::Picture(int width, int height)
    : width_(width),
      height_(height),
      bytes_(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

void Picture::set(int x, int y, const Colour& colour) {
  const auto bytes = bytes_of(colour);
  std::transform(bytes.begin(), bytes.end(), pixel(x, y), rounded);
}

void Picture::cover(int x, int y, const Colour& colour, float share) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
  const auto bytes = bytes_of(colour);
  std::uint8_t* under = pixel(x, y);
  for (std::size_t i = 0; i < 3; ++i)
    under[i] = rounded(static_cast<float>(under[i]) * (1 - share) + bytes[i] * share);
}

std::string Picture::png() const {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_);
  image.height = static_cast<png_uint_32>(height_);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string file(size, '\0');
  if (png_image_write_to_memory(&image, file.data(), &size, 0, bytes_.data(), 0, nullptr) == 0)
    throw std::runtime_error(image.message);
  file.resize(size);
  return file;
}

}  // namespace weft::client
