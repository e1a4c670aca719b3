#include "client/page/packed_frames.h"

#include <cmath>
#include <new>

namespace weft::client {
namespace {

constexpr std::string_view kBase64 =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::uint32_t zigzag(std::uint32_t difference) {
  return (difference << 1) ^ (difference >> 31 != 0 ? ~0U : 0U);
}

// Four characters for up to three bytes.
std::string base64(std::string_view bytes) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 3; ++i)
    bits = bits << 8 | (i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0U);
  std::string text(4, '=');
  for (std::size_t i = 0; i <= bytes.size(); ++i) text[i] = kBase64[bits >> (18 - 6 * i) & 63];
  return text;
}

}  // namespace

PackedFrames::PackedFrames(OutputFile& file, const std::array<double, 3>& origin_m,
                           double quantum_m)
    : file_(file), origin_(origin_m), quantum_(quantum_m) {
  if (deflateInit(&stream_, Z_BEST_COMPRESSION) != Z_OK) throw std::bad_alloc();
}

PackedFrames::~PackedFrames() { deflateEnd(&stream_); }

void PackedFrames::add(const Points& points) {
  const std::size_t values = 3 * points.x.size();
  last_.resize(values);
  planes_.resize(4 * values);
  const std::array coordinates{&points.x, &points.y, &points.z};
  for (std::size_t i = 0; i < values; ++i) {
    const double steps = ((*coordinates[i % 3])[i / 3] - origin_[i % 3]) / quantum_;
    const auto number = static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(steps)));
    const std::uint32_t packed = zigzag(number - last_[i]);
    last_[i] = number;
    for (std::size_t plane = 0; plane < 4; ++plane)
      planes_[plane * values + i] = static_cast<char>(packed >> (8 * plane) & 255);
  }
  deflate_more(planes_, Z_NO_FLUSH);
}

void PackedFrames::finish() {
  deflate_more({}, Z_FINISH);
  if (!rest_.empty()) file_.write(base64(rest_));
}

void PackedFrames::deflate_more(std::string_view bytes, int flush) {
  std::string input(bytes);  // zlib wants it writable
  stream_.next_in = reinterpret_cast<Bytef*>(input.data());
  stream_.avail_in = static_cast<uInt>(input.size());
  std::array<char, 1 << 14> output{};
  do {
    stream_.next_out = reinterpret_cast<Bytef*>(output.data());
    stream_.avail_out = static_cast<uInt>(output.size());
    deflate(&stream_, flush);
    write_base64({output.data(), output.size() - stream_.avail_out});
  } while (stream_.avail_out == 0);
}

void PackedFrames::write_base64(std::string_view bytes) {
  rest_ += bytes;
  const std::size_t whole = rest_.size() / 3 * 3;
  std::string text;
  for (std::size_t i = 0; i < whole; i += 3) text += base64({rest_.data() + i, 3});
  rest_.erase(0, whole);
  file_.write(text);
}

}  // namespace weft::client
