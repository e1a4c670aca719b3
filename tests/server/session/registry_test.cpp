#include "server/session/registry.h"

#include <gmock/gmock.h>

#include "tests/server/session/session_support.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> ids(const std::vector<std::shared_ptr<Session>>& sessions) {
  std::vector<std::string> result;
  for (const auto& session : sessions) result.push_back(session->id());
  return result;
}

class RegistryTest : public ::testing::Test {
 protected:
  std::optional<Registry::Refused> add(const std::string& id) {
    return registry_.add(make_session(scheduler_, hung_scene(), kMuchHistory, id));
  }
  Scheduler scheduler_{1};
  Registry registry_{{.max_sessions = 3}};
};

TEST_F(RegistryTest, ListsInOrderOfIdPageByPage) {
  for (const char* id : {"b", "c", "a"}) EXPECT_FALSE(add(id));
  EXPECT_THAT(ids(registry_.list("", 2)), ElementsAre("a", "b"));
  EXPECT_THAT(ids(registry_.list("b", 2)), ElementsAre("c"));
}

TEST_F(RegistryTest, RefusesAnIdThatIsTakenAndOneTooMany) {
  EXPECT_FALSE(add("a"));
  EXPECT_TRUE(std::holds_alternative<Registry::Exists>(add("a").value()));
  EXPECT_FALSE(add("b"));
  EXPECT_FALSE(add("c"));
  EXPECT_EQ(std::get<Quota::Excess>(add("d").value()).bound.most, 3);
  registry_.erase(registry_.find("b"));
  EXPECT_FALSE(add("d"));
}

TEST_F(RegistryTest, EndsWhatItErases) {
  EXPECT_FALSE(add("a"));
  const auto session = registry_.find("a");
  registry_.erase(registry_.find("a"));
  EXPECT_EQ(registry_.find("a"), nullptr);
  EXPECT_EQ(step(*session, 1).refused(), Refusal::Why::kDeleted);
}

TEST_F(RegistryTest, TakesNoSessionOnceItIsClosed) {
  EXPECT_FALSE(add("a"));
  registry_.close(Refusal::Why::kDraining);
  EXPECT_TRUE(std::holds_alternative<Registry::Closed>(add("b").value()));
  EXPECT_EQ(step(*registry_.find("a"), 1).refused(), Refusal::Why::kDraining);
}

}  // namespace
}  // namespace weft::testing
