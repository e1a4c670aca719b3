#include "server/rpc/frame_encoding.h"

#include <gmock/gmock.h>

#include <thread>
#include <vector>

namespace weft::testing {
namespace {

using ::testing::SizeIs;

std::shared_ptr<const Frame> frame_of_100() {
  auto frame = std::make_shared<Frame>();
  frame->positions.assign(300, 0.5);
  frame->velocities.assign(300, 0.25);
  frame->pressures.assign(100, 1234.5);
  frame->clearances.assign(100, -0.125);
  return frame;
}

bool share_bytes(const std::vector<grpc::ByteBuffer>& one,
                 const std::vector<grpc::ByteBuffer>& two) {
  grpc::Slice first, second;
  EXPECT_TRUE(one.at(0).TrySingleSlice(&first).ok());
  EXPECT_TRUE(two.at(0).TrySingleSlice(&second).ok());
  return first.begin() == second.begin();
}

TEST(FrameEncoding, IsMadeOnceForAllWatchersOfAFormat) {
  const auto frame = frame_of_100();
  const FrameOrder order{.format = with_defaults({}), .most_bytes = 4096};
  std::vector<std::vector<grpc::ByteBuffer>> buffers(8);
  {
    std::vector<std::jthread> watchers;
    for (auto& buffer : buffers) {
      watchers.emplace_back([&] { buffer = encoded_frame(*frame, order); });
    }
  }
  for (const auto& buffer : buffers) EXPECT_TRUE(share_bytes(buffer, buffers[0]));
  FrameOrder other = order;
  other.format.set_velocities(true);
  EXPECT_FALSE(share_bytes(encoded_frame(*frame, other), buffers[0]));
}

TEST(FrameEncoding, SendsNoMessageLargerThanItsBoundAndNoByteTwice) {
  const auto frame = frame_of_100();
  FrameOrder order{.sheets = {Grid{.rows = 4, .columns = 25}}};
  order.format.set_velocities(true);
  order.format.set_normals(true);
  order.format.set_pressure(true);
  order.format.set_clearance(true);
  order.format.set_stats(true);
  for (const auto encoding : {v1::FRAME_ENCODING_FLOAT32, v1::FRAME_ENCODING_FLOAT64,
                              v1::FRAME_ENCODING_QUANTIZED_ZSTD}) {
    order.format.set_encoding(encoding);
    order.format = with_defaults(order.format);
    order.most_bytes = 1 << 20;
    const auto all = to_proto(*frame, order);
    ASSERT_THAT(all, SizeIs(1));
    EXPECT_FALSE(all[0].continued());
    for (order.most_bytes = 1024; order.most_bytes < 9000; order.most_bytes += 997) {
      v1::Frame joined;
      bool continued = true;
      for (const v1::Frame& part : to_proto(*frame, order)) {
        EXPECT_TRUE(continued);
        EXPECT_LE(part.ByteSizeLong() + 16, order.most_bytes);
        EXPECT_EQ(part.stats().SerializeAsString(), all[0].stats().SerializeAsString());
        joined.mutable_positions_m()->append(part.positions_m());
        joined.mutable_velocities_m_per_s()->append(part.velocities_m_per_s());
        joined.mutable_normals()->append(part.normals());
        joined.mutable_pressure_pa()->append(part.pressure_pa());
        joined.mutable_clearance_m()->append(part.clearance_m());
        continued = part.continued();
      }
      EXPECT_FALSE(continued);
      EXPECT_EQ(joined.positions_m(), all[0].positions_m());
      EXPECT_EQ(joined.velocities_m_per_s(), all[0].velocities_m_per_s());
      EXPECT_EQ(joined.normals(), all[0].normals());
      EXPECT_EQ(joined.pressure_pa(), all[0].pressure_pa());
      EXPECT_EQ(joined.clearance_m(), all[0].clearance_m());
    }
  }
}

}  // namespace
}  // namespace weft::testing
