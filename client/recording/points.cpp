#include "client/recording/points.h"

#include <bit>
#include <cstring>

namespace weft::client {
namespace {

static_assert(std::endian::native == std::endian::little, "frames are little-endian");

template <class Number>
std::vector<double> read_plane(const std::string& planes, std::size_t plane, std::size_t first,
                               std::size_t count) {
  const std::size_t particles = planes.size() / (3 * sizeof(Number));
  std::vector<Number> numbers(count);
  std::memcpy(numbers.data(), planes.data() + (plane * particles + first) * sizeof(Number),
              count * sizeof(Number));
  return {numbers.begin(), numbers.end()};
}

template <class Number>
Points read_planes(const std::string& planes, std::size_t first, std::size_t count) {
  return {.x = read_plane<Number>(planes, 0, first, count),
          .y = read_plane<Number>(planes, 1, first, count),
          .z = read_plane<Number>(planes, 2, first, count)};
}

}  // namespace

Points read_points(const std::string& planes, v1::FrameEncoding encoding, std::size_t first,
                   std::size_t count) {
  return encoding == v1::FRAME_ENCODING_FLOAT64 ? read_planes<double>(planes, first, count)
                                                : read_planes<float>(planes, first, count);
}

Points read_points(const std::string& planes, v1::FrameEncoding encoding) {
  const bool doubles = encoding == v1::FRAME_ENCODING_FLOAT64;
  return read_points(planes, encoding, 0,
                     planes.size() / (3 * (doubles ? sizeof(double) : sizeof(float))));
}

}  // namespace weft::client
