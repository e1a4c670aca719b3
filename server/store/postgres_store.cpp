#include <spdlog/spdlog.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <iterator>
#include <map>
#include <mutex>
#include <pqxx/pqxx>
#include <set>
#include <thread>
#include <utility>

#include "server/convert/convert.h"
#include "server/store/assets.h"
#include "server/store/postgres_connection.h"
#include "server/store/postgres_statements.h"
#include "server/store/postgres_tables.h"
#include "server/store/postgres_values.h"
#include "server/store/records.h"
#include "server/store/snapshot_table.h"
#include "server/store/snapshots.h"
#include "server/store/store.h"
#include "server/store/tenures.h"
#include "server/store/write_queue.h"

namespace weft {
namespace {

using records::checksum;
using records::entry_key;
using std::chrono::milliseconds;

constexpr milliseconds kLease{3000}, kRenewal{400};
constexpr milliseconds kLongestWait{3000};  // for what another transaction locks
static_assert(PostgresConnection::kIdleInTransaction < std::min(kLease, kLongestWait));
constexpr milliseconds kFirstPause{50}, kLongestPause{1000};  // before work is tried again
constexpr int kOrphans = 4;                                   // that are named at a time

const std::vector<PostgresConnection::Statement> kLogStatements = {
    {"progress",
     "UPDATE weft.session SET progress = $4, checksum = $5 "
     "WHERE uid = $1 AND owner = $2 AND epoch = $3"},
    {"entry",
     "INSERT INTO weft.entry VALUES ($1, $2, $3, $4) ON CONFLICT (uid, number) "
     "DO UPDATE SET record = excluded.record, checksum = excluded.checksum"}};

// Work on a session that is another server's now changes nothing, and says so.
class PostgresStore final : public SessionStore {
 public:
  PostgresStore(const std::string& url, std::string replica)
      : replica_(std::move(replica)),
        log_(url, kLogStatements),
        calls_(url),
        lease_(url),
        assets_(std::make_unique<PostgresTables>(url)),
        snapshots_(std::make_unique<SnapshotTable>(url, tenures_)) {}
  ~PostgresStore() override { stop(); }

  LeftBehind load() override;
  void add(const KeptSession& session, const Request& creation,
           const SessionSnapshot* beginning) override;
  SessionSnapshot named_snapshot(const std::string& uid, const std::string& id) override {
    return snapshots_.read(uid, id);
  }
  std::optional<SessionSnapshot> snapshot(const std::string& uid,
                                          const SavedSession& saved) override {
    return snapshots_.read(uid, saved.limit.history_from, saved.first);
  }
  std::unique_ptr<SessionLog> log_of(const std::string& uid, std::int64_t entries) override;
  void erase(const std::string& uid, const Request& deletion,
             const SessionLog::Written& written) override;
  Assets& assets() override { return assets_; }

  bool is_shared() const override { return true; }
  bool has_others() const override { return true; }
  Claim claim(const std::string& id) override;
  void let_go(const SessionIdentity& identity) override;
  std::vector<ListedSession> list(const std::string& after, std::size_t count,
                                  const std::optional<std::string>& owner) override;
  std::optional<CarriedOut> find_request(const std::string& id) override;
  void watch(Watch watch) override;
  void leave() override;

 private:
  class Log;
  // What is done of one session; false where it is not this server's.
  using Work = std::function<bool(pqxx::work&)>;
  struct Job {
    std::string uid;
    Work work;
    SessionLog::Written written;
  };

  static void keep_request(pqxx::work& transaction, const Request& request, const std::string& uid);
  LeftSession read_session(pqxx::work& transaction, const std::string& uid, const std::string& id,
                           const records::Row& progress);
  void post(const std::string& uid, Work work, SessionLog::Written written) {
    writes_.post({uid, std::move(work), std::move(written)});
  }
  void commit(std::deque<Job> jobs);
  void finish(const Job& job, const std::string& error, bool own);
  void lose(const std::string& uid);

  bool renew();
  void look_for_losses();
  void look_for_orphans();
  void clear_up();
  void keep_lease();
  void stop();

  const std::string replica_;
  std::int64_t number_ = 0;  // of this process among all replicas
  Tenures tenures_;
  PostgresConnection log_, calls_, lease_;
  Assets assets_;
  std::mutex losing_;
  std::mutex mutex_;
  Watch watch_;  // guarded by mutex_
  WriteQueue<Job> writes_{[this](std::deque<Job> jobs) { commit(std::move(jobs)); }};
  std::thread keeper_;
  Snapshots snapshots_;  // whose thread posts writes
};

void PostgresStore::stop() {
  writes_.stop();
  if (keeper_.joinable()) keeper_.join();
}

LeftBehind PostgresStore::load() {
  const int newest = static_cast<int>(std::size(postgres::kVersions));
  calls_.run([&](pqxx::work& transaction) {
    transaction.exec("SELECT pg_advisory_xact_lock(7311)");  // one server at a time
    transaction.exec("CREATE SCHEMA IF NOT EXISTS weft");
    transaction.exec("CREATE TABLE IF NOT EXISTS weft.version (number INT NOT NULL)");
    const auto rows = transaction.exec("SELECT number FROM weft.version");
    const int found = rows.empty() ? 0 : rows[0][0].as<int>();
    if (found > newest) {
      throw StoreError(calls_.place() + " has tables of a newer weftd, version " +
                       std::to_string(found) + "; this one knows " + std::to_string(newest));
    }
    for (int i = found; i < newest; ++i) transaction.exec(postgres::kVersions[i]);
    if (rows.empty()) transaction.exec("INSERT INTO weft.version VALUES (0)");
    transaction.exec_params("UPDATE weft.version SET number = $1", newest);
    number_ = number_of(transaction.exec1("SELECT nextval('weft.replica_number')")[0]);
  });
  renew();
  clear_up();
  return {};
}

void PostgresStore::keep_request(pqxx::work& transaction, const Request& request,
                                 const std::string& uid) {
  if (request.id.empty()) return;
  const auto row = transaction.exec_params1(
      "INSERT INTO weft.request VALUES ($1, $2, $3) "
      "ON CONFLICT (id) DO UPDATE SET id = excluded.id RETURNING uid",
      request.id, static_cast<std::int64_t>(request.checksum), uid);
  if (row[0].as<std::string>() != uid)
    throw StoreError("another server carries out the same request; send it again");
}

void PostgresStore::add(const KeptSession& session, const Request& creation,
                        const SessionSnapshot* beginning) {
  const std::string& uid = session.identity.uid;
  records::Progress come;
  if (beginning != nullptr) {
    come.entries = beginning->entries;
    come.limit.frame = beginning->simulation.frame;
  }
  const std::string record = records::encode(session), progress = records::encode(come);
  calls_.run([&](pqxx::work& transaction) {
    keep_request(transaction, creation, uid);
    transaction.exec_params(
        "INSERT INTO weft.session VALUES ($1, $2, $3, $4, 1, $5, $6) ON CONFLICT DO NOTHING", uid,
        session.identity.id, session.identity.owner, number_, binary(progress),
        static_cast<std::int64_t>(checksum(uid, progress)));
    const auto row = transaction.exec_params1(
        "SELECT uid, principal FROM weft.session WHERE id = $1", session.identity.id);
    if (row[0].as<std::string>() != uid) throw SessionExists(row[1].as<std::string>());
    transaction.exec_params("INSERT INTO weft.scene VALUES ($1, $2, $3) ON CONFLICT DO NOTHING",
                            uid, binary(record), static_cast<std::int64_t>(checksum(uid, record)));
    PostgresStatements statements(transaction);
    Assets::use(statements, uid, session.identity.owner, assets_of(session.scene));
  });
  tenures_.set(uid, {number_, 1});
  if (beginning == nullptr) return;
  try {
    snapshots_.begin(uid, *beginning);
  } catch (const StoreError&) {
    erase(uid, {}, [](const std::string&) {});
    throw;
  }
}

void PostgresStore::erase(const std::string& uid, const Request& deletion,
                          const SessionLog::Written& written) {
  const Tenure tenure = tenures_.of(uid);
  post(
      uid,
      [uid, deletion, tenure](pqxx::work& transaction) {
        const auto own = transaction.exec_params(
            "SELECT FROM weft.session WHERE uid = $1 AND owner = $2 AND epoch = $3", uid,
            tenure.owner, tenure.epoch);
        if (!own.empty()) {
          PostgresStatements statements(transaction);
          Assets::release(statements, uid, std::chrono::system_clock::now());
        }
        transaction.exec_params(
            "DELETE FROM weft.session WHERE uid = $1 AND owner = $2 AND epoch = $3", uid,
            tenure.owner, tenure.epoch);
        const auto left = transaction.exec_params("SELECT FROM weft.session WHERE uid = $1", uid);
        if (left.empty()) keep_request(transaction, deletion, uid);
        return left.empty();
      },
      [this, uid, written](const std::string& error) {
        if (error.empty()) tenures_.erase(uid);
        written(error);
      });
}

class PostgresStore::Log final : public SessionLog {
 public:
  Log(PostgresStore& store, std::string uid, std::int64_t entries)
      : store_(store), uid_(std::move(uid)), entries_(std::make_shared<std::int64_t>(entries)) {}

  void write(const std::optional<LogEntry>& entry, const PublishLimit& limit,
             const Written& written) override {
    // the count is the writing thread's own
    const auto record = entry ? std::optional(records::encode(*entry)) : std::nullopt;
    store_.post(
        uid_,
        [record, limit, uid = uid_, tenure = store_.tenures_.of(uid_),
         entries = entries_](pqxx::work& transaction) {
          const std::string progress =
              records::encode(records::Progress{*entries + (record ? 1 : 0), limit});
          const bool own =
              transaction
                  .exec_prepared("progress", uid, tenure.owner, tenure.epoch, binary(progress),
                                 static_cast<std::int64_t>(checksum(uid, progress)))
                  .affected_rows() == 1;
          if (own && record) {
            transaction.exec_prepared(
                "entry", uid, *entries, binary(*record),
                static_cast<std::int64_t>(checksum(entry_key(uid, *entries), *record)));
          }
          return own;
        },
        [entries = entries_, added = record.has_value(), written](const std::string& error) {
          if (error.empty() && added) ++*entries;
          written(error);
        });
  }

  bool offer(const Take& take, std::int64_t oldest) override {
    const auto forget = [&store = store_, uid = uid_](std::int64_t entries) {
      store.post(
          uid,
          [uid, entries, tenure = store.tenures_.of(uid)](pqxx::work& transaction) {
            transaction.exec_params(
                "DELETE FROM weft.entry e USING weft.session s WHERE e.uid = $1 AND e.number < $2 "
                "AND s.uid = $1 AND s.owner = $3 AND s.epoch = $4 AND $2 >= $5 + "
                "(SELECT min(number) FROM weft.entry WHERE uid = $1)",
                uid, entries, tenure.owner, tenure.epoch, records::kFewEntries);
            return true;
          },
          [](const std::string&) {});
    };
    return store_.snapshots_.write(uid_, take, oldest, forget);
  }

  void keep(const std::string& id, std::shared_ptr<const SessionSnapshot> snapshot,
            const Kept& kept) override {
    store_.snapshots_.keep(uid_, id, std::move(snapshot), kept);
  }
  void drop(const std::string& id) override { store_.snapshots_.drop(uid_, id); }

 private:
  PostgresStore& store_;
  const std::string uid_;
  const std::shared_ptr<std::int64_t> entries_;  // of the log
};

std::unique_ptr<SessionLog> PostgresStore::log_of(const std::string& uid, std::int64_t entries) {
  return std::make_unique<Log>(*this, uid, entries);
}

// While the database is away its work waits: what became of the last of it is not known, and all of
// it may be done again.
void PostgresStore::commit(std::deque<Job> jobs) {
  std::vector<bool> own;
  for (milliseconds time = kFirstPause;; time = std::min(2 * time, kLongestPause)) try {
      log_.run([&](pqxx::work& transaction) {
        own.clear();
        for (const Job& job : jobs) own.push_back(job.work(transaction));
      });
      for (std::size_t i = 0; i < jobs.size(); ++i) finish(jobs[i], {}, own[i]);
      return;
    } catch (const StoreLost& error) {
      if (time == kFirstPause) spdlog::warn("{}; changes wait", error.what());
      if (writes_.pause(time)) continue;
      for (const Job& job : jobs) finish(job, error.what(), true);
      return;
    } catch (const StoreError& error) {
      if (jobs.size() > 1) break;
      spdlog::error("{}", error.what());
      return finish(jobs.front(), error.what(), true);
    }
  for (Job& job : jobs) commit({std::move(job)});
}

void PostgresStore::finish(const Job& job, const std::string& error, bool own) {
  if (!own) lose(job.uid);
  job.written(own ? error : "another server has the session");
}

// Another server has it, or none. Returns after `taken`, whoever is first to see it: what is
// refused then is known to be elsewhere.
void PostgresStore::lose(const std::string& uid) {
  const std::lock_guard one_at_a_time(losing_);
  if (!tenures_.erase(uid)) return;
  std::function<void(const std::string&)> taken;
  {
    std::lock_guard lock(mutex_);
    taken = watch_.taken;
  }
  if (taken) taken(uid);
}

LeftSession PostgresStore::read_session(pqxx::work& transaction, const std::string& uid,
                                        const std::string& id, const records::Row& progress) {
  const auto scene =
      transaction.exec_params("SELECT record, checksum FROM weft.scene WHERE uid = $1", uid);
  if (scene.empty()) throw StoreError("its scene is missing");
  std::vector<records::NumberedRow> entries;
  for (const auto& row : transaction.exec_params(
           "SELECT number, record, checksum FROM weft.entry WHERE uid = $1 ORDER BY number", uid)) {
    entries.push_back({{bytes_of(row[1]), number_of(row[2])}, number_of(row[0])});
  }
  return records::assemble(uid, id, {bytes_of(scene[0][0]), number_of(scene[0][1])}, progress,
                           entries, assets_);
}

Claim PostgresStore::claim(const std::string& id) {
  Claim claim;
  Tenure tenure;
  std::string uid;
  calls_.run([&](pqxx::work& transaction) {
    claim = {};
    uid.clear();
    transaction.exec("SET LOCAL lock_timeout = " + std::to_string(kLongestWait.count()));
    const auto taken = transaction.exec_params(
        "UPDATE weft.session SET owner = $2, epoch = epoch + 1 "
        "WHERE id = $1 AND (owner = $2 OR NOT weft.holds(owner, $2)) "
        "RETURNING uid, epoch, progress, checksum, principal",
        id, number_);
    if (taken.empty()) {
      const auto rows = transaction.exec_params(
          "SELECT s.principal, coalesce(r.name, '') FROM weft.session s "
          "LEFT JOIN weft.replica r ON r.number = s.owner WHERE s.id = $1",
          id);
      if (!rows.empty())
        claim = Elsewhere{rows[0][1].as<std::string>(), rows[0][0].as<std::string>()};
      return;
    }
    uid = taken[0][0].as<std::string>();
    tenure = {number_, number_of(taken[0][1])};
    try {
      claim = read_session(transaction, uid, id, {bytes_of(taken[0][2]), number_of(taken[0][3])});
    } catch (const StoreLost&) {
      throw;
    } catch (const StoreError& error) {
      claim = DamagedSession{id, uid, error.what(), taken[0][4].as<std::string>()};
    }
  });
  if (uid.empty()) return claim;
  tenures_.set(uid, tenure);
  if (auto* left = std::get_if<LeftSession>(&claim))
    left->saved.named = snapshots_.named(uid, left->saved.entries());
  return claim;
}

void PostgresStore::let_go(const SessionIdentity& identity) {
  const std::string& uid = identity.uid;
  const Tenure tenure = tenures_.of(uid);
  calls_.run([&](pqxx::work& transaction) {
    transaction.exec_params(
        "UPDATE weft.session SET owner = 0 WHERE uid = $1 AND owner = $2 AND epoch = $3", uid,
        tenure.owner, tenure.epoch);
  });
  tenures_.erase(uid);
}

std::vector<ListedSession> PostgresStore::list(const std::string& after, std::size_t count,
                                               const std::optional<std::string>& owner) {
  std::vector<ListedSession> sessions;
  calls_.run([&](pqxx::work& transaction) {
    sessions.clear();
    // ids are ASCII, and ordered as this program orders them
    for (const auto& row : transaction.exec_params(
             "SELECT c.record, c.checksum, s.uid, coalesce(r.name, '') FROM weft.session s "
             "JOIN weft.scene c USING (uid) LEFT JOIN weft.replica r ON r.number = s.owner "
             "WHERE s.id COLLATE \"C\" > $1 AND ($2 OR s.principal = $3) "
             "ORDER BY s.id COLLATE \"C\" LIMIT $4",
             after, !owner, owner.value_or(""), static_cast<std::int64_t>(count))) {
      auto session =
          records::listed(row[2].as<std::string>(), {bytes_of(row[0]), number_of(row[1])});
      if (!session) continue;
      session->replica = row[3].as<std::string>();
      sessions.push_back(*std::move(session));
    }
  });
  return sessions;
}

std::optional<CarriedOut> PostgresStore::find_request(const std::string& id) {
  std::optional<CarriedOut> found;
  if (id.empty()) return found;
  calls_.run([&](pqxx::work& transaction) {
    found.reset();
    const auto rows = transaction.exec_params(
        "SELECT r.checksum, r.uid, coalesce(s.id, '') FROM weft.request r "
        "LEFT JOIN weft.session s USING (uid) WHERE r.id = $1",
        id);
    if (rows.empty()) return;
    const auto crc = static_cast<std::uint32_t>(number_of(rows[0][0]));
    found = CarriedOut{{{id, crc}, rows[0][1].as<std::string>()}, rows[0][2].as<std::string>()};
  });
  return found;
}

void PostgresStore::watch(Watch watch) {
  {
    std::lock_guard lock(mutex_);
    watch_ = std::move(watch);
  }
  keeper_ = std::thread([this] { keep_lease(); });
}

// True where there was a gap: others may have taken sessions over.
bool PostgresStore::renew() {
  bool gap = true;
  lease_.run([&](pqxx::work& transaction) {
    const auto renewed = transaction.exec_params(
        "WITH before AS (SELECT lease_until < now() AS gap FROM weft.replica WHERE number = $1 "
        "FOR UPDATE) UPDATE weft.replica SET pid = pg_backend_pid(), backend_start = (SELECT "
        "backend_start FROM pg_stat_activity WHERE pid = pg_backend_pid()), renewed = now(), "
        "lease_until = now() + $2 * INTERVAL '1 ms', since = CASE WHEN gap THEN now() ELSE since "
        "END FROM before WHERE number = $1 RETURNING gap",
        number_, static_cast<std::int64_t>(kLease.count()));
    gap = renewed.empty() || renewed[0][0].as<bool>();
    if (!renewed.empty()) return;
    transaction.exec_params(
        "INSERT INTO weft.replica SELECT $1::bigint, $2::text, pid, backend_start, now(), "
        "now() + $3 * INTERVAL '1 ms', now() FROM pg_stat_activity WHERE pid = pg_backend_pid()",
        number_, replica_, static_cast<std::int64_t>(kLease.count()));
  });
  return lease_.is_new() || gap;
}

void PostgresStore::look_for_losses() {
  std::set<std::string> missing = tenures_.uids();
  lease_.run([&](pqxx::work& transaction) {
    for (const auto& row :
         transaction.exec_params("SELECT uid FROM weft.session WHERE owner = $1", number_))
      missing.erase(row[0].as<std::string>());
  });
  for (const std::string& uid : missing) lose(uid);
}

void PostgresStore::look_for_orphans() {
  std::vector<std::string> ids;
  lease_.run([&](pqxx::work& transaction) {
    ids.clear();
    for (const auto& row : transaction.exec_params(
             "SELECT s.id FROM weft.replica r JOIN weft.session s ON s.owner = r.number "
             "WHERE r.number <> $1 AND NOT weft.holds(r.number, $1) ORDER BY random() LIMIT $2 "
             "FOR UPDATE OF s SKIP LOCKED",  // or claims that must wait would pile up
             number_, kOrphans))
      ids.push_back(row[0].as<std::string>());
  });
  for (const std::string& id : ids) watch_.orphaned(id);
}

// What nobody needs any more.
void PostgresStore::clear_up() {
  lease_.run([&](pqxx::work& transaction) {
    transaction.exec(
        "DELETE FROM weft.replica r WHERE lease_until < now() - INTERVAL '1 hour' "
        "AND NOT EXISTS (SELECT FROM weft.session WHERE owner = r.number)");
    transaction.exec("DELETE FROM weft.request WHERE carried_out < now() - INTERVAL '24 hours'");
  });
}

void PostgresStore::keep_lease() {
  constexpr int kClearUp = 1000;  // renewals
  bool reached = true, gap = false;
  for (int turn = 1; writes_.pause(kRenewal); ++turn) try {
      gap = renew() || gap;
      if (gap) look_for_losses();
      gap = false;
      look_for_orphans();
      if (turn % kClearUp == 0) clear_up();
      if (!std::exchange(reached, true)) spdlog::info("{} is back", lease_.place());
    } catch (const StoreError& error) {
      if (std::exchange(reached, false)) spdlog::warn("{}", error.what());
    }
}

void PostgresStore::leave() {
  stop();
  try {
    lease_.run([&](pqxx::work& transaction) {
      transaction.exec_params(
          "UPDATE weft.replica SET pid = 0, renewed = now(), lease_until = now() WHERE number = $1",
          number_);
    });
  } catch (const StoreError& error) {
    spdlog::warn("{}; other servers take over when the lease has run out", error.what());
  }
}

}  // namespace

std::unique_ptr<SessionStore> open_postgres_store(const std::string& url,
                                                  const std::string& replica) {
  return std::make_unique<PostgresStore>(url, replica);
}

}  // namespace weft
