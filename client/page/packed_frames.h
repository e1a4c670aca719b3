#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/exports/output_file.h"
#include "client/recording/points.h"

namespace weft::client {

// Writes frames the way a page holds them. Coordinates are whole numbers of `quantum` from
// `origin`, rounded: x, y, z of particle 0, of particle 1 ... Each is kept as its difference to the
// frame before (the first: to 0), modulo 2^32, as 0, -1, 1, -2 ... -> 0, 1, 2, 3 ...; of these a
// frame is four planes, the lowest bytes first. All frames together are one zlib stream, in base64.
class PackedFrames {
 public:
  PackedFrames(OutputFile& file, const std::array<double, 3>& origin_m, double quantum_m);
  ~PackedFrames();
  PackedFrames(const PackedFrames&) = delete;
  PackedFrames& operator=(const PackedFrames&) = delete;

  void add(const Points& points);
  void finish();

 private:
  void deflate_more(std::string_view bytes, int flush);
  void write_base64(std::string_view bytes);

  OutputFile& file_;
  std::array<double, 3> origin_;
  double quantum_;
  std::vector<std::uint32_t> last_;
  std::string planes_;
  z_stream stream_{};
  std::string rest_;  // up to 2 bytes that wait for a third
};

}  // namespace weft::client
