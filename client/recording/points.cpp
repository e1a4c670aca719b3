#include "client/recording/points.h"

#include <zstd.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

#include "client/problem.h"
#include "client/sheet_layout.h"

namespace weft::client {
namespace {

static_assert(std::endian::native == std::endian::little, "frames are little-endian");

template <class Number>
std::vector<double> numbers_in(const std::string& array) {
  std::vector<Number> numbers(array.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), array.data(), array.size());
  return {numbers.begin(), numbers.end()};
}

// The bytes in a packed array, where they are byte planes of so many numbers.
std::optional<std::string> unpack(const std::string& array, std::size_t numbers) {
  constexpr std::size_t kMostPlanes = 8;
  constexpr std::size_t kMostOfAByte = ZSTD_BLOCKSIZE_MAX / 3;  // a block has 3 bytes at least
  const auto size = ZSTD_getFrameContentSize(array.data(), array.size());  // as it claims
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR || size < numbers ||
      size % numbers != 0 || size / numbers > kMostPlanes || size / kMostOfAByte > array.size()) {
    return std::nullopt;
  }
  std::string bytes(size, '\0');
  if (ZSTD_decompress(bytes.data(), size, array.data(), array.size()) != size) return std::nullopt;
  return bytes;
}

// The numbers of an array of FRAME_ENCODING_QUANTIZED_ZSTD: planes of `count` each.
std::vector<double> unpacked(const std::string& array, std::size_t planes, std::size_t count,
                             double step) {
  const std::string bytes = unpack(array, planes * count).value();
  std::vector<std::uint64_t> numbers(planes * count);
  const char* byte = bytes.data();
  for (std::size_t plane = 0; plane < bytes.size() / numbers.size(); ++plane) {
    for (std::uint64_t& number : numbers)
      number |= std::uint64_t{static_cast<unsigned char>(*byte++)} << 8 * plane;
  }
  std::vector<double> values(numbers.size());
  for (std::size_t first = 0; first < numbers.size(); first += count) {
    std::uint64_t steps = 0;
    for (std::size_t i = first; i < first + count; ++i) {
      steps += numbers[i] >> 1 ^ -(numbers[i] & 1);
      values[i] = static_cast<double>(static_cast<std::int64_t>(steps)) * step;
    }
  }
  return values;
}

// An array of planes of `count` numbers; those of QUANTIZED_ZSTD are multiples of the grid step
// times `scale`.
std::vector<double> read_planes(const std::string& array, const v1::StreamHeader& header,
                                std::size_t planes, double scale = 1) {
  if (array.empty()) return {};
  switch (header.format().encoding()) {
    case v1::FRAME_ENCODING_FLOAT64:
      return numbers_in<double>(array);
    case v1::FRAME_ENCODING_QUANTIZED_ZSTD:
      return unpacked(array, planes, particle_count(header), scale * header.format().grid_step_m());
    default:
      return numbers_in<float>(array);
  }
}

bool is_whole(const std::string& array, const v1::FrameFormat& format, std::size_t numbers) {
  if (numbers == 0) return array.empty();
  switch (format.encoding()) {
    case v1::FRAME_ENCODING_FLOAT64:
      return array.size() == numbers * sizeof(double);
    case v1::FRAME_ENCODING_QUANTIZED_ZSTD:
      return unpack(array, numbers).has_value();
    default:
      return array.size() == numbers * sizeof(float);
  }
}

// Whether it is one of all particles that can be read.
bool is_known(const v1::FrameFormat& format) {
  if (format.first_particle() != 0 || format.has_particle_count() || format.has_stride())
    return false;
  switch (format.encoding()) {
    case v1::FRAME_ENCODING_FLOAT32:
    case v1::FRAME_ENCODING_FLOAT64:
      return true;
    case v1::FRAME_ENCODING_QUANTIZED_ZSTD:
      return format.grid_step_m() > 0 && std::isfinite(format.grid_step_m());
    default:
      return false;
  }
}

}  // namespace

std::size_t particle_count(const v1::StreamHeader& header) {
  constexpr std::int64_t kMostParticles = std::numeric_limits<std::int32_t>::max();
  std::int64_t particles = 0;
  // frames are counted from here
  constexpr std::int64_t kLastStart = std::int64_t{1} << 62;
  bool sound = header.start_frame() >= 0 && header.start_frame() <= kLastStart;
  sound = sound && is_known(header.format());
  for (const auto& sheet : header.sheets()) {
    sound = sound && is_sound(sheet) && sheet.first_particle() == particles;
    if (!sound) break;
    particles += static_cast<std::int64_t>(particle_count(sheet));
    sound = particles <= kMostParticles;
  }
  if (!sound || particles == 0) {
    throw Problem(Exit::kRefused, "DATA_LOSS", "HEADER_UNREADABLE",
                  "the header names sheets, a format or a first frame that no stream has");
  }
  return static_cast<std::size_t>(particles);
}

std::size_t triangle_count(const v1::StreamHeader& header) {
  std::size_t triangles = 0;
  for (const auto& sheet : header.sheets()) triangles += triangle_count(sheet);
  return triangles;
}

bool is_whole(const v1::Frame& frame, const v1::StreamHeader& header) {
  const v1::FrameFormat& format = header.format();
  const std::size_t particles = particle_count(header);
  const auto whole = [&](const std::string& array, bool wanted, std::size_t numbers) {
    return wanted ? is_whole(array, format, numbers) : array.empty();
  };
  return whole(frame.positions_m(), true, 3 * particles) &&
         whole(frame.velocities_m_per_s(), format.velocities(), 3 * particles) &&
         whole(frame.strain(), format.strain(), 3 * triangle_count(header)) &&
         whole(frame.pressure_pa(), format.pressure(), particles) &&
         whole(frame.clearance_m(), format.clearance(), particles);
}

Points read_points(const std::string& array, const v1::StreamHeader& header, std::size_t first,
                   std::size_t count) {
  const std::vector<double> values = read_planes(array, header, 3);
  const auto plane = [&](std::size_t axis) {
    const auto begin =
        values.begin() + static_cast<std::ptrdiff_t>(axis * (values.size() / 3) + first);
    return std::vector(begin, begin + static_cast<std::ptrdiff_t>(count));
  };
  return {.x = plane(0), .y = plane(1), .z = plane(2)};
}

Points read_points(const std::string& array, const v1::StreamHeader& header) {
  return read_points(array, header, 0, particle_count(header));
}

std::vector<double> read_pressures(const v1::Frame& frame, const v1::StreamHeader& header) {
  constexpr double kSteps = 1000;  // Pa for each m of the grid step
  return read_planes(frame.pressure_pa(), header, 1, kSteps);
}

std::vector<double> read_clearances(const v1::Frame& frame, const v1::StreamHeader& header) {
  return read_planes(frame.clearance_m(), header, 1);
}

}  // namespace weft::client
