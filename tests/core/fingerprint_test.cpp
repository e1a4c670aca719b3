#include "core/fingerprint.h"

#include <gmock/gmock.h>
#include <hwy/targets.h>

namespace weft::testing {
namespace {

std::uint64_t fingerprint_of(std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  const std::uint64_t found = fingerprint();
  hwy::SetSupportedTargetsForTest(0);
  return found;
}

TEST(Fingerprint, IsOneOnAllProcessorsWithFma) {
  for (const std::int64_t target : {HWY_AVX2, HWY_AVX3, HWY_NEON}) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    EXPECT_EQ(fingerprint_of(target), fingerprint()) << hwy::TargetName(target);
  }
}

TEST(Fingerprint, IsAnotherWhereBitsAre) {
  if (HWY_STATIC_TARGET == HWY_NEON) GTEST_SKIP() << "every processor of this kind has FMA";
  EXPECT_NE(fingerprint_of(HWY_STATIC_TARGET), fingerprint());
}

}  // namespace
}  // namespace weft::testing
