#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "client/recording/points.h"
#include "server/rpc/frame_encoding.h"

// What the server packs with FRAME_ENCODING_QUANTIZED_ZSTD and the client unpacks.
namespace weft::testing {
namespace {

constexpr int kCount = 500;

v1::StreamHeader header_of(double step) {
  v1::StreamHeader header;
  header.add_sheets()->set_rows(1);
  header.mutable_sheets(0)->set_columns(kCount);
  header.mutable_format()->set_encoding(v1::FRAME_ENCODING_QUANTIZED_ZSTD);
  header.mutable_format()->set_grid_step_m(step);
  return header;
}

v1::Frame packed(const std::vector<double>& positions, const v1::StreamHeader& header) {
  Frame frame;
  frame.positions = positions;
  return to_proto(frame, {.format = header.format(), .most_bytes = 1 << 20}).at(0);
}

// Positions of any size up to the farthest there are, of both signs, and 0.
std::vector<double> wild_positions(double farthest) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-12, std::log10(farthest)), sign(-1, 1);
  std::vector<double> positions{0, farthest, -farthest, farthest, 1e-300, -0.0};
  while (positions.size() < 3 * kCount)
    positions.push_back(std::copysign(std::pow(10, exponent(random)), sign(random)));
  return positions;
}

TEST(Quantized, KeepsEveryPositionWithinHalfAStep) {
  for (const double step : {1e-5, 1e-4, 0.1}) {
    for (const double farthest : {1e-4, 3.0, 1e9}) {
      const auto sent = wild_positions(farthest);
      const v1::StreamHeader header = header_of(step);
      const v1::Frame frame = packed(sent, header);
      ASSERT_TRUE(client::is_whole(frame, header));
      const client::Points found = client::read_points(frame.positions_m(), header);
      for (std::size_t i = 0; i < sent.size(); ++i) {
        const auto& plane = i < kCount ? found.x : i < 2 * kCount ? found.y : found.z;
        const double rounding = 4e-16 * std::abs(sent[i]);
        ASSERT_NEAR(plane[i % kCount], sent[i], step / 2 + rounding) << step;
      }
    }
  }
}

TEST(Quantized, IsRefusedWhereItIsCutShortOrOfAnotherSize) {
  const v1::StreamHeader header = header_of(1e-4);
  v1::Frame frame = packed(wild_positions(3), header);
  const std::string whole = frame.positions_m();
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    frame.set_positions_m(whole.substr(0, size));
    ASSERT_FALSE(client::is_whole(frame, header)) << size;
  }
  frame.set_positions_m(whole + "x");
  EXPECT_FALSE(client::is_whole(frame, header));
  frame.set_positions_m(whole);
  v1::StreamHeader other = header;
  other.mutable_sheets(0)->set_columns(kCount - 1);
  EXPECT_FALSE(client::is_whole(frame, other));
}

}  // namespace
}  // namespace weft::testing
