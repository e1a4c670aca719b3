#include "client/recording/layout.h"

#include <zlib.h>

#include <array>

namespace weft::client {
namespace {

uLong add(uLong crc, std::string_view bytes) {
  return crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

}  // namespace

std::int64_t checksum_of_text(std::string_view scene, std::string_view header) {
  return static_cast<std::int64_t>(add(add(0, scene), header));
}

std::int64_t checksum_of_frame(std::string_view uid, std::int64_t number, std::string_view frame) {
  std::array<char, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<char>((number >> (8 * i)) & 0xff);
  return static_cast<std::int64_t>(add(add(add(0, uid), {bytes.data(), bytes.size()}), frame));
}

}  // namespace weft::client
