#include "server/session/quota.h"

#include <gmock/gmock.h>

namespace weft::testing {
namespace {

// The name of the bound in the way, or none.
std::string bound(const Quota& quota, const std::string& principal, std::int64_t amount) {
  const auto excess = quota.excess(principal, amount);
  return excess ? excess->bound.name : "";
}

TEST(Quota, BoundsEachPrincipalAndAllTogether) {
  Quota quota({"all", 10}, {"each", 6});
  auto ann = quota.take("ann", 6);
  ASSERT_TRUE(std::holds_alternative<Quota::Share>(ann));
  EXPECT_EQ(bound(quota, "ann", 1), "each");
  EXPECT_EQ(bound(quota, "bob", 4), "");
  EXPECT_EQ(bound(quota, "bob", 5), "all");
  EXPECT_FALSE(std::get<Quota::Excess>(quota.take("bob", 6)).for_ever);
  EXPECT_TRUE(std::get<Quota::Excess>(quota.take("bob", 11)).for_ever);
  ann = Quota::Share();
  EXPECT_EQ(bound(quota, "ann", 6), "");
}

TEST(Quota, GivesBackWhatIsHeldOnceWhereverItWasMoved) {
  Quota quota({"all", 1}, {"each", 1});
  {
    Quota::Share first = quota.hold("ann", 1);
    Quota::Share second(std::move(first));
    first = std::move(second);
    EXPECT_EQ(bound(quota, "bob", 1), "all");
  }
  EXPECT_EQ(bound(quota, "bob", 1), "");
}

TEST(Quota, HoldsMoreThanItsBoundsWhereItMust) {
  Quota quota({"all", 1}, {"each", 1});
  const auto one = quota.hold("ann", 1), two = quota.hold("ann", 1);
  EXPECT_EQ(bound(quota, "ann", 0), "all");
}

}  // namespace
}  // namespace weft::testing
