#include "server/rpc/frame_encoding.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <list>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "core/lattice/shown.h"
#include "core/model/normals.h"
#include "core/model/strain.h"
#include "core/model/text.h"
#include "server/rpc/bytes.h"

namespace weft {
namespace {

static_assert(std::endian::native == std::endian::little, "planes are little-endian");

// Of all particles, as checked by find_problems: first, first + stride, ...
struct Selection {
  std::int64_t first = 0;
  std::int64_t stride = 1;
  std::int64_t count = 0;
};

Selection selection(const v1::FrameFormat& format, std::int64_t particles) {
  const std::int64_t first = format.first_particle();
  const std::int64_t stride = format.has_stride() ? format.stride() : 1;
  const std::int64_t covered =
      format.has_particle_count() ? format.particle_count() : particles - first;
  return {first, stride, (covered + stride - 1) / stride};
}

// Of so many particles, in each plane.
std::vector<double> selected(const std::vector<double>& values, std::int64_t particles,
                             const Selection& wanted) {
  std::vector<double> result;
  for (std::int64_t plane = 0; plane < std::ssize(values); plane += particles) {
    for (std::int64_t i = 0; i < wanted.count; ++i)
      result.push_back(values[static_cast<std::size_t>(plane + wanted.first + i * wanted.stride)]);
  }
  return result;
}

template <class Number>
std::string planes_of(const std::vector<double>& values) {
  const std::vector<Number> numbers(values.begin(), values.end());
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

// The lowest byte of all numbers, then the next, as far as there are others than 0.
std::string byte_planes(const std::vector<std::uint64_t>& numbers) {
  std::uint64_t all = 0;
  for (const std::uint64_t number : numbers) all |= number;
  const auto bits = std::max<std::size_t>(1, std::bit_width(all));
  std::string planes((bits + 7) / 8 * numbers.size(), '\0');
  char* to = planes.data();
  for (std::size_t shift = 0; shift < bits; shift += 8) {
    for (const std::uint64_t number : numbers) *to++ = static_cast<char>(number >> shift);
  }
  return planes;
}

// Differences of neighbours on the grid; small ones of either sign are small numbers. The guard
// keeps every value below 1e9, so that no sum leaves 64 bits.
std::vector<std::uint64_t> quantized(const std::vector<double>& values, std::size_t planes,
                                     double step) {
  std::vector<std::uint64_t> numbers(values.size());
  const std::size_t count = values.size() / planes;
  for (std::size_t first = 0; first < values.size(); first += count) {
    std::int64_t before = 0;
    for (std::size_t i = first; i < first + count; ++i) {
      const double steps = values[i] / step;
      const auto nearest = static_cast<std::int64_t>(steps + std::copysign(0.5, steps));
      const std::int64_t difference = nearest - std::exchange(before, nearest);
      numbers[i] = static_cast<std::uint64_t>(difference) << 1 ^
                   static_cast<std::uint64_t>(difference >> 63);
    }
  }
  return numbers;
}

std::string compressed(const std::string& bytes) {
  std::string result(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(result.data(), result.size(), bytes.data(), bytes.size(), 1);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();
  result.resize(size);
  return result;
}

// step: of what is QUANTIZED_ZSTD.
std::string bytes_of(const std::vector<double>& values, std::size_t planes,
                     v1::FrameEncoding encoding, double step) {
  switch (encoding) {
    case v1::FRAME_ENCODING_FLOAT64:
      return planes_of<double>(values);
    case v1::FRAME_ENCODING_QUANTIZED_ZSTD:
      return compressed(byte_planes(quantized(values, planes, step)));
    default:
      return planes_of<float>(values);
  }
}

constexpr double kPressureSteps = 1000;  // of the grid step in m, each of 1 Pa

// The values of a frame's particles that are asked for, of all that are shown: planes of them, one
// after the other.
class ParticleArrays {
 public:
  ParticleArrays(const v1::FrameFormat& format, std::int64_t particles)
      : format_(format), particles_(particles), wanted_(selection(format, particles)) {}

  std::string bytes(const std::vector<double>& values, double scale = 1) const {
    const auto planes = values.size() / static_cast<std::size_t>(particles_);
    const double step = scale * format_.grid_step_m();
    return bytes_of(wanted_.count == particles_ ? values : selected(values, particles_, wanted_),
                    planes, format_.encoding(), step);
  }

 private:
  const v1::FrameFormat& format_;
  std::int64_t particles_;
  Selection wanted_;
};

// The values of a frame as they are shown; where that is as they are simulated, without a copy.
class Interpolated {
 public:
  explicit Interpolated(const std::vector<SheetShape>& sheets)
      : sheets_(sheets), differs_(std::any_of(sheets.begin(), sheets.end(), is_interpolated)) {}

  const std::vector<double>& of(const std::vector<double>& values) {
    return differs_ ? made_.emplace_back(shown_values(values, sheets_)) : values;
  }
  // A curve through pressures may swing below 0.
  std::vector<double> of_pressures(std::vector<double> values) const {
    if (!differs_) return values;
    values = shown_values(values, sheets_);
    for (double& value : values) value = std::max(value, 0.0);
    return values;
  }

 private:
  const std::vector<SheetShape>& sheets_;
  bool differs_;
  std::list<std::vector<double>> made_;
};

// Their arrays, joined, are the frame's.
std::vector<v1::Frame> in_parts(v1::Frame frame, std::int64_t most_bytes) {
  constexpr std::size_t kRest = 256;  // number, time, stats, tags and lengths
  const auto room = static_cast<std::size_t>(most_bytes) - kRest;
  using Array = std::string* (v1::Frame::*)();
  constexpr std::array<Array, 6> kArrays{
      &v1::Frame::mutable_positions_m, &v1::Frame::mutable_velocities_m_per_s,
      &v1::Frame::mutable_normals,     &v1::Frame::mutable_strain,
      &v1::Frame::mutable_pressure_pa, &v1::Frame::mutable_clearance_m};
  std::array<std::string, kArrays.size()> arrays;
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    arrays[k].swap(*(frame.*kArrays[k])());
    bytes += arrays[k].size();
  }
  std::vector<v1::Frame> parts{frame};
  if (bytes <= room) {
    for (std::size_t k = 0; k < arrays.size(); ++k) (parts[0].*kArrays[k])()->swap(arrays[k]);
    return parts;
  }
  std::size_t left = room;
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    for (std::size_t from = 0; from < arrays[k].size();) {
      if (left == 0) {
        parts.back().set_continued(true);
        parts.push_back(frame);
        left = room;
      }
      const std::size_t count = std::min(left, arrays[k].size() - from);
      (parts.back().*kArrays[k])()->assign(arrays[k], from, count);
      from += count;
      left -= count;
    }
  }
  return parts;
}

}  // namespace

v1::FrameFormat with_defaults(v1::FrameFormat format) {
  if (format.encoding() == v1::FRAME_ENCODING_UNSPECIFIED) {
    format.set_encoding(v1::FRAME_ENCODING_FLOAT32);
  }
  if (format.encoding() != v1::FRAME_ENCODING_QUANTIZED_ZSTD) {
    format.clear_grid_step_m();
  } else if (!format.has_grid_step_m()) {
    format.set_grid_step_m(1e-4);
  }
  return format;
}

std::vector<Problem> find_problems(const v1::FrameFormat& format, std::int64_t particles) {
  std::vector<Problem> problems;
  if (!v1::FrameEncoding_IsValid(format.encoding())) {
    problems.push_back(
        {"format.encoding", std::to_string(format.encoding()) + " is no weft.v1.FrameEncoding"});
  }
  const double step = format.grid_step_m();
  if (format.has_grid_step_m() && !(step >= 1e-5 && step <= 0.1)) {  // NaN too
    problems.push_back({"format.grid_step_m", join(step, " m is not within 1e-05 to 0.1 m")});
  }
  const auto check = [&](const char* field, std::int64_t value, std::int64_t low,
                         std::int64_t high) {
    if (value < low || value > high) {
      problems.push_back({std::string("format.") + field,
                          std::to_string(value) + " is not within " + std::to_string(low) + " to " +
                              std::to_string(high)});
    }
  };
  const std::int64_t first = format.first_particle();
  check("first_particle", first, 0, particles - 1);
  if (format.has_particle_count() && first >= 0 && first < particles)
    check("particle_count", format.particle_count(), 1, particles - first);
  if (format.has_stride()) check("stride", format.stride(), 1, particles);
  return problems;
}

std::vector<v1::Frame> to_proto(const Frame& frame, const FrameOrder& order) {
  const v1::FrameFormat& format = order.format;
  v1::Frame message;
  message.set_number(frame.number);
  message.set_time_s(frame.time);
  const std::vector<SheetShape> sheets = shown(order.sheets);
  Interpolated values(order.sheets);
  const std::vector<double>& x = values.of(frame.positions);
  const ParticleArrays arrays(format, std::ssize(x) / 3);
  message.set_positions_m(arrays.bytes(x));
  if (format.velocities())
    message.set_velocities_m_per_s(arrays.bytes(values.of(frame.velocities)));
  if (format.normals()) message.set_normals(arrays.bytes(normals_of(x, sheets)));
  if (format.strain())
    message.set_strain(bytes_of(strains_of(x, sheets), 3, format.encoding(), format.grid_step_m()));
  if (format.pressure())
    message.set_pressure_pa(arrays.bytes(values.of_pressures(pressures_of(frame)), kPressureSteps));
  if (format.clearance()) message.set_clearance_m(arrays.bytes(clearances_of(frame, x)));
  if (format.stats()) {
    v1::FrameStats* stats = message.mutable_stats();
    const Deformation deformation = deformation_of(frame);
    stats->set_kinetic_energy_j(frame.kinetic_energy);
    stats->set_potential_energy_j(deformation.potential_energy);
    stats->set_largest_strain(deformation.largest_strain);
    stats->set_substep_count(frame.substeps);
    stats->set_substep_s(frame.substep);
    stats->set_at_rest(frame.at_rest);
    stats->set_repair_count(static_cast<std::int64_t>(frame.repairs.size()));
    if (frame.cloth_cuts) stats->set_cloth_cut_count(*frame.cloth_cuts);
    if (frame.residual) stats->set_residual(*frame.residual);
    stats->mutable_pose_times_s()->Assign(frame.pose_times.begin(), frame.pose_times.end());
  }
  return in_parts(std::move(message), order.most_bytes);
}

std::vector<grpc::ByteBuffer> encoded_frame(const Frame& frame, const FrameOrder& order) {
  using Buffers = std::vector<grpc::ByteBuffer>;
  const auto encoding = frame.encodings.get(order.format.SerializeAsString(), [&] {
    auto buffers = std::make_shared<Buffers>();
    std::size_t bytes = 0;
    for (v1::Frame& part : to_proto(frame, order)) {
      v1::StreamFramesResponse message;
      *message.mutable_frame() = std::move(part);
      bytes += buffers->emplace_back(encoded(message)).Length();
    }
    return Encoding{buffers, bytes};
  });
  return *static_cast<const Buffers*>(encoding.get());  // shares the bytes
}

}  // namespace weft
