#include "server/rpc/frame_encoding.h"

#include <gmock/gmock.h>

#include <thread>
#include <vector>

namespace weft::testing {
namespace {

std::shared_ptr<const Frame> frame_of_100() {
  auto frame = std::make_shared<Frame>();
  frame->positions.assign(300, 0.5);
  frame->velocities.assign(300, 0.25);
  return frame;
}

bool share_bytes(const grpc::ByteBuffer& one, const grpc::ByteBuffer& two) {
  grpc::Slice first, second;
  EXPECT_TRUE(one.TrySingleSlice(&first).ok());
  EXPECT_TRUE(two.TrySingleSlice(&second).ok());
  return first.begin() == second.begin();
}

TEST(FrameEncoding, IsMadeOnceForAllWatchersOfAFormat) {
  const auto frame = frame_of_100();
  const v1::FrameFormat format = with_defaults({});
  std::vector<grpc::ByteBuffer> buffers(8);
  {
    std::vector<std::jthread> watchers;
    for (auto& buffer : buffers) {
      watchers.emplace_back([&] { buffer = encoded_frame(*frame, format); });
    }
  }
  for (const auto& buffer : buffers) EXPECT_TRUE(share_bytes(buffer, buffers[0]));
  v1::FrameFormat other = format;
  other.set_velocities(true);
  EXPECT_FALSE(share_bytes(encoded_frame(*frame, other), buffers[0]));
}

TEST(FrameEncoding, TakesNoMoreBytesThanIsSaid) {
  const auto frame = frame_of_100();
  for (const auto encoding : {v1::FRAME_ENCODING_FLOAT32, v1::FRAME_ENCODING_FLOAT64,
                              v1::FRAME_ENCODING_QUANTIZED_ZSTD}) {
    for (const bool velocities : {false, true}) {
      v1::FrameFormat format;
      format.set_encoding(encoding);
      format.set_velocities(velocities);
      format.set_stats(true);
      format = with_defaults(format);
      EXPECT_LE(encoded_frame(*frame, format).Length(),
                static_cast<std::size_t>(frame_bytes(format, 100)));
    }
  }
}

}  // namespace
}  // namespace weft::testing
