#include "client/recording/points.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>

#include "client/problem.h"

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

std::size_t array_bytes(const v1::StreamHeader& header) {
  constexpr std::int64_t kMostParticles = std::numeric_limits<std::int32_t>::max();
  std::int64_t particles = 0;
  // frames are counted from here
  constexpr std::int64_t kLastStart = std::int64_t{1} << 62;
  bool sound = header.start_frame() >= 0 && header.start_frame() <= kLastStart;
  sound = sound && (header.format().encoding() == v1::FRAME_ENCODING_FLOAT32 ||
                    header.format().encoding() == v1::FRAME_ENCODING_FLOAT64);
  for (const auto& sheet : header.sheets()) {
    sound = sound && sheet.rows() > 0 && sheet.columns() > 0 && sheet.first_particle() == particles;
    if (!sound) break;
    particles += std::int64_t{sheet.rows()} * sheet.columns();
    sound = particles <= kMostParticles;
  }
  if (!sound || particles == 0) {
    throw Problem(Exit::kRefused, "DATA_LOSS", "HEADER_UNREADABLE",
                  "the header names sheets, a format or a first frame that no stream has");
  }
  const bool doubles = header.format().encoding() == v1::FRAME_ENCODING_FLOAT64;
  return 3 * static_cast<std::size_t>(particles) * (doubles ? sizeof(double) : sizeof(float));
}

bool is_whole(const v1::Frame& frame, std::size_t array_bytes, bool velocities) {
  return frame.positions_m().size() == array_bytes &&
         frame.velocities_m_per_s().size() == (velocities ? array_bytes : 0);
}

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
