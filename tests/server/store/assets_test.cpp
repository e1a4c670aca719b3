#include "server/store/assets.h"

#include <gmock/gmock.h>

#include <chrono>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/store/postgres_statements.h"
#include "server/store/sqlite_tables.h"
#include "server/store/store.h"
#include "tests/support/service/postgres.h"
#include "tests/support/temporary_directory.h"

namespace weft::testing {
namespace {

using std::chrono::hours;
using Time = Assets::Time;

// Assets of every store, on a clock of the test's.
class AssetStores : public ::testing::Test {
 protected:
  void SetUp() override {
    stores_.push_back(std::make_unique<Assets>(open_sqlite_tables(":memory:")));
    stores_.push_back(std::make_unique<Assets>(open_sqlite_tables(directory_.path("assets.db"))));
    if (!Postgres::is_installed()) return;
    database_ = std::make_unique<Postgres>();
    open_postgres_store(database_->url(), "test")->load();  // makes the tables
    // sessions that use something are in the same database
    PostgresConnection(database_->url()).run([](pqxx::work& transaction) {
      for (const char* uid : {"one", "two"})
        transaction.exec_params("INSERT INTO weft.session VALUES ($1, $1, 'ann', 0, 0, '', 0)",
                                uid);
    });
    stores_.push_back(std::make_unique<Assets>(std::make_unique<PostgresTables>(database_->url())));
  }

  static KeptAsset put(Assets& assets, const std::string& bytes, const std::string& owner,
                       Time now) {
    EXPECT_EQ(assets.put(sha256(bytes), owner, bytes, "facts", {}, now), std::nullopt);
    return assets.find(sha256(bytes), owner).value_or(KeptAsset{});
  }
  static KeptAsset begin(Assets& assets, const std::string& bytes, Time now,
                         const std::string& owner = "ann") {
    return std::get<KeptAsset>(
        assets.begin(sha256(bytes), owner, static_cast<std::int64_t>(bytes.size()), {}, now));
  }

  const TemporaryDirectory directory_;
  std::unique_ptr<Postgres> database_;
  std::vector<std::unique_ptr<Assets>> stores_;
  const Time start_{hours(24 * 20'000)};
};

TEST_F(AssetStores, ForgetWhatNoSessionHasNamedForLong) {
  for (const auto& assets : stores_) {
    const KeptAsset used = put(*assets, "used", "ann", start_);
    const KeptAsset unused = put(*assets, "unused", "ann", start_);
    const KeptAsset begun = begin(*assets, "begun", start_);
    assets->use("one", "ann", {used.hash});
    assets->sweep(start_);
    EXPECT_EQ(assets->total().count, 3);
    assets->sweep(start_ + hours(1));
    EXPECT_TRUE(assets->find(used.hash, "ann"));
    EXPECT_FALSE(assets->find(unused.hash, "ann"));
    EXPECT_FALSE(assets->find(begun.hash, "ann"));
    EXPECT_EQ(assets->piece(unused, 0), "");

    // its time counts from when the last session has gone
    assets->release("one", start_ + hours(30));
    assets->sweep(start_ + hours(30));
    EXPECT_TRUE(assets->find(used.hash, "ann"));
    assets->sweep(start_ + hours(31));
    EXPECT_FALSE(assets->find(used.hash, "ann"));
    EXPECT_EQ(assets->total().bytes, 0);
  }
}

TEST_F(AssetStores, DeleteNothingThatASessionOfTheSameOwnerUses) {
  for (const auto& assets : stores_) {
    const KeptAsset hers = put(*assets, "shared", "ann", start_);
    const KeptAsset his = put(*assets, "shared", "bob", start_);
    EXPECT_EQ(hers.content, his.content) << "kept once";
    assets->use("one", "ann", {hers.hash});
    assets->use("two", "ann", {hers.hash});
    EXPECT_FALSE(assets->erase(hers));
    EXPECT_TRUE(assets->erase(his));
    assets->release("one", start_);
    EXPECT_FALSE(assets->erase(hers));
    assets->keep_only({"one"}, start_);
    EXPECT_TRUE(assets->erase(hers));
    EXPECT_THROW(assets->use("one", "ann", {hers.hash}), StoreError);
  }
}

TEST_F(AssetStores, TakeAPieceFromOneOfTwoWhoSendIt) {
  for (const auto& assets : stores_) {
    const std::string bytes(Assets::kPiece + 10, 'x');
    const KeptAsset one = begin(*assets, bytes, start_), other = begin(*assets, bytes, start_);
    EXPECT_EQ(assets->append(one, bytes.substr(0, Assets::kPiece), start_), Assets::kPiece);
    EXPECT_EQ(assets->append(other, bytes.substr(0, Assets::kPiece), start_), Assets::kPiece);
    KeptAsset next = *assets->find(one.hash, "ann");
    EXPECT_EQ(assets->append(next, bytes.substr(Assets::kPiece), start_), Assets::kPiece + 10);
    assets->finish(next, "facts", start_);
    const KeptAsset whole = *assets->find(one.hash, "ann");
    EXPECT_EQ(whole.create_time, start_);
    EXPECT_EQ(assets->bytes(whole), bytes);
    EXPECT_EQ(assets->append(next, "more", start_), Assets::kPiece + 10) << "nothing is added";
  }
}

TEST_F(AssetStores, KeepBytesOnceThatTwoHaveSent) {
  for (const auto& assets : stores_) {
    const KeptAsset hers = put(*assets, "the same", "ann", start_);
    const KeptAsset begun = begin(*assets, "the same", start_, "bob");
    EXPECT_NE(begun.content, hers.content);
    assets->append(begun, "the same", start_);
    assets->finish(begun, "facts", start_);
    EXPECT_EQ(assets->find(hers.hash, "bob")->content, hers.content);
    EXPECT_EQ(assets->piece(begun, 0), "");
    EXPECT_EQ(assets->total().bytes, 16) << "counted for both";
  }
}

TEST_F(AssetStores, BeginAnewWhereTheSizeWasWrong) {
  for (const auto& assets : stores_) {
    const KeptAsset wrong =
        std::get<KeptAsset>(assets->begin(sha256("four"), "ann", 9, {}, start_));
    const KeptAsset right = begin(*assets, "four", start_);
    EXPECT_NE(right.content, wrong.content);
    EXPECT_EQ(assets->append(wrong, "four", start_), 0) << "of an upload that is gone";
    EXPECT_EQ(assets->append(right, "four", start_), 4);
  }
}

TEST_F(AssetStores, HaveABoundForAllTogether) {
  Limits limits;
  limits.max_total_asset_bytes = 10;
  for (const auto& assets : stores_) {
    EXPECT_EQ(assets->put(sha256("123456"), "ann", "123456", "", limits, start_), std::nullopt);
    const auto excess = assets->put(sha256("abcdef"), "bob", "abcdef", "", limits, start_);
    ASSERT_TRUE(excess);
    EXPECT_EQ(excess->bound.name, std::string("total_asset_bytes"));
    EXPECT_FALSE(excess->for_ever);
  }
}

}  // namespace
}  // namespace weft::testing
