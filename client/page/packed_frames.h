#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "client/recording/points.h"
#include "client/sheet_layout.h"

namespace weft::client {

// Bytes as a page holds them: one zlib stream, in base64.
class Deflated {
 public:
  using Sink = std::function<void(std::string_view text)>;

  explicit Deflated(Sink sink);
  ~Deflated();
  Deflated(const Deflated&) = delete;
  Deflated& operator=(const Deflated&) = delete;

  void add(std::string_view bytes) { deflate_more(bytes, Z_NO_FLUSH); }
  void finish();

 private:
  void deflate_more(std::string_view bytes, int flush);
  void write_base64(std::string_view bytes);

  Sink sink_;
  z_stream stream_{};
  std::string rest_;  // up to 2 bytes that wait for a third
};

std::string deflated(std::string_view bytes);

// What a particle is guessed from: where the triangle across its longest edge would have it, as the
// fourth corner of a parallelogram, a + b - c.
struct Guess {
  std::int32_t particle, a, b, c;  // as many as there are particles: none, 0
};

// Of every particle once, from particles before it in this order. Triangles may be none.
std::vector<Guess> guesses_of(const std::vector<Triangle>& triangles, const Points& points);

// A value that was recorded of each particle, in levels: level q of `most` stands for
// low + (high - low) (q / most)^2.
struct Levels {
  double low = 0, high = 0;
  int most = 255;
  unsigned char of(double value) const;
};

// Writes frames the way a page holds them. Coordinates are whole numbers of `quantum` from
// `origin`, rounded; of each its move is kept, the difference to the frame before (of the first: to
// 0), less what the guess makes of the moves of others. First the guesses come: of each the
// particle, less that of the one before, then the particle less a, less b, less c, all guesses'
// first numbers, their second ... Then of every frame the moves along x of all particles, in their
// order, along y, along z. A number is modulo 2^32, as 0, -1, 1, -2 ... -> 0, 1, 2, 3 ...; the
// guesses, and each frame, are four planes, the lowest bytes first.
class PackedFrames {
 public:
  PackedFrames(Deflated::Sink sink, const std::vector<Guess>& guesses,
               const std::array<double, 3>& origin_m, double quantum_m);

  void add(const Points& points);
  void finish() { deflated_.finish(); }

 private:
  void write_planes();

  const std::vector<Guess>& guesses_;
  std::array<double, 3> origin_;
  double quantum_;
  std::array<std::vector<std::uint32_t>, 3> last_, moves_;  // the latter with a 0 behind them
  std::vector<std::uint32_t> numbers_;
  std::string planes_;
  Deflated deflated_;
};

}  // namespace weft::client
