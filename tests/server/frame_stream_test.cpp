#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

TEST(StreamFrames, SendsAHeaderAndThenEveryFrameInOrder) {
  Service service;
  const v1::Session session = service.create();
  service.step(session.name(), 5);
  Stream stream(service, frames_of(session, 0, 5));
  const v1::StreamHeader header = stream.header();
  EXPECT_EQ(header.uid(), session.uid());
  EXPECT_EQ(header.sheets(0).rows(), 4);
  EXPECT_EQ(header.sheets(0).columns(), 5);
  const auto frames = stream.rest();
  ASSERT_EQ(frames.size(), 6u);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(frames[static_cast<std::size_t>(i)].number(), i);
  EXPECT_EQ(frames[3].positions_m().size(), 3 * 20 * sizeof(double));
  EXPECT_TRUE(stream.finish().ok());
}

}  // namespace
}  // namespace weft::testing
