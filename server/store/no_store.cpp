#include <map>
#include <mutex>
#include <utility>

#include "server/convert/convert.h"
#include "server/convert/numerics.h"
#include "server/store/assets.h"
#include "server/store/records.h"
#include "server/store/sqlite_tables.h"
#include "server/store/store.h"

namespace weft {
namespace {

// Snapshots on demand are kept in memory, as long as their session.
class NoStore final : public SessionStore {
 public:
  LeftBehind load() override { return {}; }
  void add(const KeptSession& session, const Request& /*creation*/,
           const SessionSnapshot* /*beginning*/) override {
    assets_.use(session.identity.uid, session.identity.owner, assets_of(session.scene));
  }
  SessionSnapshot named_snapshot(const std::string& uid, const std::string& id) override {
    std::lock_guard lock(mutex_);
    const auto found = snapshots_.find({uid, id});
    if (found == snapshots_.end()) throw StoreError("it is gone");
    return *found->second;
  }
  std::optional<SessionSnapshot> snapshot(const std::string& /*uid*/,
                                          const SavedSession& /*saved*/) override {
    return std::nullopt;
  }
  std::unique_ptr<SessionLog> log_of(const std::string& uid, std::int64_t /*entries*/) override {
    return std::make_unique<Log>(*this, uid);
  }
  void erase(const std::string& uid, const Request& /*deletion*/,
             const SessionLog::Written& written) override {
    assets_.release(uid, std::chrono::system_clock::now());
    written({});
  }
  Assets& assets() override { return assets_; }

 private:
  class Log final : public NoLog {
   public:
    Log(NoStore& store, std::string uid) : store_(store), uid_(std::move(uid)) {}
    ~Log() override {
      std::lock_guard lock(store_.mutex_);
      std::erase_if(store_.snapshots_, [&](const auto& each) { return each.first.first == uid_; });
    }
    void keep(const std::string& id, std::shared_ptr<const SessionSnapshot> snapshot,
              const Kept& kept) override {
      const auto bytes = static_cast<std::int64_t>(records::encode(uid_, *snapshot).size());
      const NamedSnapshot named{
          id, snapshot->simulation.frame, snapshot->create_time, bytes, numerics_id(), {}};
      {
        std::lock_guard lock(store_.mutex_);
        store_.snapshots_[{uid_, id}] = std::move(snapshot);
      }
      kept({}, named);
    }
    void drop(const std::string& id) override {
      std::lock_guard lock(store_.mutex_);
      store_.snapshots_.erase({uid_, id});
    }

   private:
    NoStore& store_;
    const std::string uid_;
  };

  Assets assets_{open_sqlite_tables(":memory:")};
  std::mutex mutex_;
  // by the session's uid and the id
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const SessionSnapshot>> snapshots_;
};

}  // namespace

std::unique_ptr<SessionStore> make_no_store() { return std::make_unique<NoStore>(); }

}  // namespace weft
