#include "server/rpc/frame_encoding.h"

#include <bit>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace weft {
namespace {

static_assert(std::endian::native == std::endian::little, "planes are little-endian");

std::size_t value_bytes(const v1::FrameFormat& format) {
  return format.encoding() == v1::FRAME_ENCODING_FLOAT64 ? sizeof(double) : sizeof(float);
}

template <class Number>
std::string planes_of(const std::vector<double>& values) {
  const std::vector<Number> numbers(values.begin(), values.end());
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

std::string planes(const std::vector<double>& values, const v1::FrameFormat& format) {
  return format.encoding() == v1::FRAME_ENCODING_FLOAT64 ? planes_of<double>(values)
                                                         : planes_of<float>(values);
}

v1::StreamFramesResponse message_of(const Frame& frame, const v1::FrameFormat& format) {
  v1::StreamFramesResponse message;
  v1::Frame* to = message.mutable_frame();
  to->set_number(frame.number);
  to->set_time_s(frame.time);
  to->set_positions_m(planes(frame.positions, format));
  if (format.velocities()) to->set_velocities_m_per_s(planes(frame.velocities, format));
  if (format.stats()) {
    v1::FrameStats* stats = to->mutable_stats();
    stats->set_kinetic_energy_j(frame.stats.kinetic_energy);
    stats->set_potential_energy_j(frame.stats.potential_energy);
    stats->set_largest_strain(frame.stats.largest_strain);
    stats->set_substep_count(frame.substeps);
    stats->set_substep_s(frame.substep);
    stats->set_at_rest(frame.at_rest);
    stats->set_repair_count(static_cast<std::int64_t>(frame.repairs.size()));
  }
  return message;
}

// A buffer that owns the bytes.
grpc::ByteBuffer buffer_of(std::string bytes) {
  auto* owned = new std::string(std::move(bytes));
  const grpc::Slice slice(
      owned->data(), owned->size(), [](void* string) { delete static_cast<std::string*>(string); },
      owned);
  return {&slice, 1};
}

}  // namespace

v1::FrameFormat with_defaults(v1::FrameFormat format) {
  if (format.encoding() == v1::FRAME_ENCODING_UNSPECIFIED) {
    format.set_encoding(v1::FRAME_ENCODING_FLOAT32);
  }
  return format;
}

std::int64_t frame_bytes(const v1::FrameFormat& format, std::int64_t particles) {
  constexpr std::int64_t kRest = 256;  // number, time, stats, tags and lengths
  return kRest + particles * 3 * static_cast<std::int64_t>(value_bytes(format)) *
                     (format.velocities() ? 2 : 1);
}

grpc::ByteBuffer encoded_frame(const Frame& frame, const v1::FrameFormat& format) {
  const int key = static_cast<int>(format.encoding()) * 4 + (format.velocities() ? 2 : 0) +
                  (format.stats() ? 1 : 0);
  const auto encoding = frame.encodings.get(key, [&] {
    auto buffer = std::make_shared<const grpc::ByteBuffer>(encoded(message_of(frame, format)));
    return Encoding{buffer, buffer->Length()};
  });
  return *static_cast<const grpc::ByteBuffer*>(encoding.get());  // shares the bytes
}

grpc::ByteBuffer encoded(const v1::StreamFramesResponse& message) {
  return buffer_of(message.SerializeAsString());
}

}  // namespace weft
