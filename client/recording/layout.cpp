#include "client/recording/layout.h"

#include <zlib.h>

#include <array>

namespace weft::client {
std::int64_t checksum_of(std::initializer_list<std::string_view> parts) {
  uLong crc = 0;
  for (const std::string_view part : parts) {
    if (part.empty()) continue;  // zlib takes a null pointer as a wish to begin anew
    crc = crc32_z(crc, reinterpret_cast<const Bytef*>(part.data()), part.size());
  }
  return static_cast<std::int64_t>(crc);
}

std::int64_t checksum_of_frame(std::string_view uid, std::int64_t number, std::string_view frame) {
  std::array<char, 8> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<char>((number >> (8 * i)) & 0xff);
  }
  return checksum_of({uid, {bytes.data(), bytes.size()}, frame});
}

}  // namespace weft::client
