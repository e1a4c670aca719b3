#include "client/frame_parts.h"

#include <gtest/gtest.h>

#include "client/problem.h"

namespace weft::testing {
namespace {

v1::Frame part(std::int64_t number, const std::string& positions, bool continued) {
  v1::Frame frame;
  frame.set_number(number);
  frame.set_positions_m(positions);
  frame.set_continued(continued);
  return frame;
}

class FrameParts : public ::testing::Test {
 protected:
  FrameParts() {
    header_.add_sheets()->set_rows(2);
    header_.mutable_sheets(0)->set_columns(2);
    header_.mutable_format()->set_encoding(v1::FRAME_ENCODING_FLOAT32);
    parts_.begin(header_);
  }

  bool join(const v1::Frame& frame) {
    frame_ = frame;
    return parts_.join(frame_);
  }

  v1::StreamHeader header_;
  client::FrameParts parts_;
  v1::Frame frame_;
};

TEST_F(FrameParts, AreOneFrameOnceTheLastHasCome) {
  EXPECT_TRUE(join(part(1, "whole", false)));
  EXPECT_EQ(frame_.positions_m(), "whole");
  EXPECT_FALSE(join(part(2, "be", true)));
  EXPECT_FALSE(join(part(2, "gu", true)));
  EXPECT_TRUE(join(part(2, "n", false)));
  EXPECT_EQ(frame_.number(), 2);
  EXPECT_EQ(frame_.positions_m(), "begun");
  EXPECT_FALSE(frame_.continued());
  EXPECT_TRUE(join(part(3, "next", false)));
  EXPECT_EQ(frame_.positions_m(), "next");
}

TEST_F(FrameParts, OfABrokenStreamAreForgotten) {
  EXPECT_FALSE(join(part(2, "be", true)));
  parts_.begin(header_);
  EXPECT_TRUE(join(part(2, "again", false)));
  EXPECT_EQ(frame_.positions_m(), "again");
}

TEST_F(FrameParts, OfOtherFramesOrWithoutEndAreRefused) {
  EXPECT_FALSE(join(part(2, "be", true)));
  EXPECT_THROW(join(part(3, "gun", false)), client::Problem);
  parts_.begin(header_);
  const auto endless = [&] {
    for (int i = 0; i < 1000; ++i) join(part(2, "and so on, and so on", true));
  };
  EXPECT_THROW(endless(), client::Problem);
}

}  // namespace
}  // namespace weft::testing
