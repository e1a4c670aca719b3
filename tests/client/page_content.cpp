#include "tests/client/page_content.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>

namespace weft::testing {
namespace {

// What stands in the script element of an id.
std::string element(const std::string& page, const std::string& id) {
  const std::size_t start = page.find('>', page.find("id=\"" + id + "\"")) + 1;
  return page.substr(start, page.find("</script>", start) - start);
}

}  // namespace

std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  return bytes;
}

std::string inflated(const std::string& page, const std::string& id) {
  const std::string packed = from_base64(element(page, id));
  z_stream stream{};
  EXPECT_EQ(inflateInit(&stream), Z_OK);
  std::string input = packed, bytes;
  stream.next_in = reinterpret_cast<Bytef*>(input.data());
  stream.avail_in = static_cast<uInt>(input.size());
  std::array<char, 1 << 14> output{};
  int state = Z_OK;
  while (state == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(output.data());
    stream.avail_out = output.size();
    state = inflate(&stream, Z_NO_FLUSH);
    bytes.append(output.data(), output.size() - stream.avail_out);
  }
  EXPECT_EQ(state, Z_STREAM_END);
  inflateEnd(&stream);
  return bytes;
}

nlohmann::json description(const std::string& page) {
  return nlohmann::json::parse(inflated(page, "page"));
}

}  // namespace weft::testing
