#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>

#include <deque>
#include <filesystem>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "server/convert/convert.h"
#include "server/store/assets.h"
#include "server/store/records.h"
#include "server/store/snapshot_files.h"
#include "server/store/snapshots.h"
#include "server/store/sqlite_tables.h"
#include "server/store/write_queue.h"

namespace weft {
namespace {

constexpr int kApplicationId = 0x57454644;  // "WEFD"
constexpr int kVersion = 1;                 // user_version of the file
constexpr int kMostRequests = 10'000;
constexpr const char* kTables = R"(
  CREATE TABLE session (
    uid TEXT PRIMARY KEY,
    id TEXT NOT NULL,
    record BLOB NOT NULL,        -- weft.storage.v1.KeptSession
    checksum INTEGER NOT NULL);  -- CRC-32 of uid and record
  CREATE TABLE progress (
    uid TEXT PRIMARY KEY,
    record BLOB NOT NULL,        -- weft.storage.v1.KeptProgress
    checksum INTEGER NOT NULL);  -- CRC-32 of uid and record
  CREATE TABLE entry (
    uid TEXT NOT NULL,
    number INTEGER NOT NULL,     -- 0, 1, 2 ... within its session
    record BLOB NOT NULL,        -- weft.storage.v1.LogEntry
    checksum INTEGER NOT NULL,   -- CRC-32 of uid, number and record
    PRIMARY KEY (uid, number)) WITHOUT ROWID;
  CREATE TABLE request (
    number INTEGER PRIMARY KEY,
    id TEXT NOT NULL,
    checksum INTEGER NOT NULL,   -- of the call
    uid TEXT NOT NULL);
)";

using records::checksum;
using records::entry_key;

std::string make_path(const std::string& directory) {
  namespace fs = std::filesystem;
  std::error_code error;
  const bool made = fs::create_directories(directory, error);
  if (made) fs::permissions(directory, fs::perms::owner_all, error);
  if (error || !fs::is_directory(directory)) {
    throw StoreError(directory + " is no directory for sessions" +
                     (error ? ": " + error.message() : ""));
  }
  return (fs::path(directory) / "sessions.db").string();
}

// What went wrong, in the words of a user.
std::string text_of(const std::string& path, const SQLite::Exception& error) {
  switch (error.getErrorCode()) {
    case SQLITE_FULL:
      return path + ": the disk is full";
    case SQLITE_READONLY:
    case SQLITE_IOERR:
      return path + " cannot be written: " + error.what();
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return path + " is used by another weftd; give this one another --data-dir";
    case SQLITE_NOTADB:
      return path + " holds no sessions of weftd";
    default:
      return path + ": " + error.what();
  }
}

std::string blob(SQLite::Column column) {
  return {static_cast<const char*>(column.getBlob()), static_cast<std::size_t>(column.getBytes())};
}

// One connection, and one thread that writes.
class SqliteStore final : public SessionStore {
 public:
  explicit SqliteStore(const std::string& directory)
      : path_(make_path(directory)), database_(open(path_)) {}
  ~SqliteStore() override { writes_.stop(); }

  LeftBehind load() override;
  std::optional<SessionSnapshot> snapshot(const std::string& uid,
                                          const SavedSession& saved) override {
    return snapshots_.read(uid, saved.limit.history_from, saved.first);
  }
  void add(const KeptSession& session, const Request& creation,
           const SessionSnapshot* beginning) override;
  SessionSnapshot named_snapshot(const std::string& uid, const std::string& id) override {
    return snapshots_.read(uid, id);
  }
  std::unique_ptr<SessionLog> log_of(const std::string& uid, std::int64_t entries) override;
  void erase(const std::string& uid, const Request& deletion,
             const SessionLog::Written& written) override;
  Assets& assets() override { return assets_; }

  bool has_others() const override;
  Claim claim(const std::string& id) override;
  void let_go(const SessionIdentity& identity) override;
  std::vector<ListedSession> list(const std::string& after, std::size_t count,
                                  const std::optional<std::string>& owner) override;

 private:
  class Log;
  using Work = std::function<void(SQLite::Database&)>;
  struct Job {
    Work work;
    SessionLog::Written written;
  };

  static SQLite::Database open(const std::string& path);
  void release(const std::string& uid);
  static void keep_request(SQLite::Database& database, const Request& request,
                           const std::string& uid);
  LeftSession load_session(const std::string& uid, const std::string& id,
                           const records::Row& session);
  void post(Work work, SessionLog::Written written) {
    writes_.post({std::move(work), std::move(written)});
  }
  void carry_out(Work work);
  std::string commit(const std::deque<Job>& jobs);

  const std::string path_;
  SQLite::Database database_;  // used by load(), then by the thread alone
  // in a file of their own: large writes do not hold up those of calls
  Assets assets_{
      open_sqlite_tables(std::filesystem::path(path_).replace_filename("assets.db").string())};
  mutable std::mutex mutex_;
  // Sessions that the server has not, by id; guarded by mutex_.
  std::map<std::string, SessionIdentity> let_go_;
  WriteQueue<Job> writes_{[this](const std::deque<Job>& jobs) {
    const std::string error = commit(jobs);
    for (const Job& job : jobs) job.written(error);
  }};
  const std::filesystem::path snapshot_directory_ =
      std::filesystem::path(path_).replace_filename("snapshots");
  Snapshots snapshots_{std::make_unique<SnapshotFiles>(snapshot_directory_)};
};

SQLite::Database SqliteStore::open(const std::string& path) try {
  SQLite::Database database(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  // one process at a time; every commit reaches the disk
  database.exec("PRAGMA locking_mode = EXCLUSIVE");
  database.exec("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL");
  database.exec("BEGIN EXCLUSIVE");
  const int application = database.execAndGet("PRAGMA application_id").getInt();
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  if (application == 0 && version == 0) {
    database.exec(kTables);
    database.exec("PRAGMA application_id = " + std::to_string(kApplicationId));
    database.exec("PRAGMA user_version = " + std::to_string(kVersion));
  } else if (application != kApplicationId) {
    throw StoreError(path + " holds no sessions of weftd");
  } else if (version != kVersion) {
    throw StoreError(path + " was made by another version of weftd");
  }
  database.exec("COMMIT");
  return database;
} catch (const SQLite::Exception& error) {
  throw StoreError(text_of(path, error));
}

LeftBehind SqliteStore::load() try {
  LeftBehind left;
  // a page may lose a session whole, and nothing of it is left to be told apart
  const std::string state = database_.execAndGet("PRAGMA quick_check(1)").getString();
  if (state != "ok") spdlog::error("{} is damaged, sessions may be missing: {}", path_, state);
  SQLite::Statement request(database_, "SELECT id, checksum, uid FROM request ORDER BY number");
  while (request.executeStep()) {
    left.requests.push_back({{request.getColumn(0).getString(),
                              static_cast<std::uint32_t>(request.getColumn(1).getInt64())},
                             request.getColumn(2).getString()});
  }
  std::set<std::string> uids;
  SQLite::Statement row(database_, "SELECT uid, id, record, checksum FROM session ORDER BY id");
  while (row.executeStep()) {
    const std::string uid = row.getColumn(0).getString();
    const std::string id = row.getColumn(1).getString();
    records::Row session;
    try {
      session = {blob(row.getColumn(2)), row.getColumn(3).getInt64()};
      left.sessions.push_back(load_session(uid, id, session));
    } catch (const StoreError& error) {
      left.damaged.push_back({id, uid, error.what(), records::owner_of(uid, session)});
    } catch (const SQLite::Exception& error) {
      left.damaged.push_back({id, uid, error.what()});
    }
    uids.insert(uid);
  }
  SnapshotFiles(snapshot_directory_).keep_only(uids);
  assets_.keep_only(uids, std::chrono::system_clock::now());
  return left;
} catch (const SQLite::Exception& error) {
  throw StoreError(text_of(path_, error));
}

LeftSession SqliteStore::load_session(const std::string& uid, const std::string& id,
                                      const records::Row& session) {
  SQLite::Statement come(database_, "SELECT record, checksum FROM progress WHERE uid = ?");
  come.bind(1, uid);
  if (!come.executeStep()) throw StoreError("it does not say how far it came");
  const records::Row progress{blob(come.getColumn(0)), come.getColumn(1).getInt64()};
  SQLite::Statement row(database_,
                        "SELECT number, record, checksum FROM entry WHERE uid = ? ORDER BY number");
  row.bind(1, uid);
  std::vector<records::NumberedRow> entries;
  while (row.executeStep()) {
    entries.push_back(
        {{blob(row.getColumn(1)), row.getColumn(2).getInt64()}, row.getColumn(0).getInt64()});
  }
  LeftSession left = records::assemble(uid, id, session, progress, entries, assets_);
  left.saved.named = snapshots_.named(uid, left.saved.entries());
  return left;
}

void SqliteStore::add(const KeptSession& session, const Request& creation,
                      const SessionSnapshot* beginning) {
  const std::string& uid = session.identity.uid;
  {
    std::lock_guard lock(mutex_);
    const auto there = let_go_.find(session.identity.id);
    if (there != let_go_.end()) throw SessionExists(there->second.owner);
  }
  assets_.use(uid, session.identity.owner, assets_of(session.scene));
  records::Progress come;
  if (beginning != nullptr) {
    snapshots_.begin(uid, *beginning);
    come.entries = beginning->entries;
    come.limit.frame = beginning->simulation.frame;
  }
  carry_out([&, record = records::encode(session),
             progress = records::encode(come)](SQLite::Database& database) {
    SQLite::Statement insert(database, "INSERT INTO session VALUES (?, ?, ?, ?)");
    insert.bind(1, uid);
    insert.bind(2, session.identity.id);
    insert.bind(3, record.data(), static_cast<int>(record.size()));
    insert.bind(4, checksum(uid, record));
    insert.exec();
    SQLite::Statement begin(database, "INSERT INTO progress VALUES (?, ?, ?)");
    begin.bind(1, uid);
    begin.bind(2, progress.data(), static_cast<int>(progress.size()));
    begin.bind(3, checksum(uid, progress));
    begin.exec();
    keep_request(database, creation, uid);
  });
}

void SqliteStore::erase(const std::string& uid, const Request& deletion,
                        const SessionLog::Written& written) {
  post(
      [uid, deletion](SQLite::Database& database) {
        for (const char* table : {"session", "progress", "entry"}) {
          SQLite::Statement erase(database, std::string("DELETE FROM ") + table + " WHERE uid = ?");
          erase.bind(1, uid);
          erase.exec();
        }
        keep_request(database, deletion, uid);
      },
      [this, uid, written](const std::string& error) {
        if (error.empty()) {
          snapshots_.erase(uid);
          release(uid);
        }
        written(error);
      });
}

// Where that cannot be written, a restart makes up for it.
void SqliteStore::release(const std::string& uid) try {
  assets_.release(uid, std::chrono::system_clock::now());
} catch (const StoreError& error) {
  spdlog::warn("assets of a session that was deleted are still in use: {}", error.what());
}

void SqliteStore::keep_request(SQLite::Database& database, const Request& request,
                               const std::string& uid) {
  if (request.id.empty()) return;
  SQLite::Statement insert(database, "INSERT INTO request (id, checksum, uid) VALUES (?, ?, ?)");
  insert.bind(1, request.id);
  insert.bind(2, static_cast<std::int64_t>(request.checksum));
  insert.bind(3, uid);
  insert.exec();
  SQLite::Statement trim(database, "DELETE FROM request WHERE number <= ?");
  trim.bind(1, database.getLastInsertRowid() - kMostRequests);
  trim.exec();
}

class SqliteStore::Log final : public SessionLog {
 public:
  Log(SqliteStore& store, std::string uid, std::int64_t entries)
      : store_(store), uid_(std::move(uid)), entries_(std::make_shared<std::int64_t>(entries)) {}

  void write(const std::optional<LogEntry>& entry, const PublishLimit& limit,
             const Written& written) override {
    // the count is the writing thread's own
    const auto record = entry ? std::optional(records::encode(*entry)) : std::nullopt;
    store_.post(
        [record, limit, uid = uid_, entries = entries_](SQLite::Database& database) {
          const records::Progress progress{*entries + (record ? 1 : 0), limit};
          if (replace(database, uid, records::encode(progress)) && record) {
            add(database, uid, *entries, *record);
          }
        },
        [entries = entries_, added = record.has_value(), written](const std::string& error) {
          if (error.empty() && added) ++*entries;
          written(error);
        });
  }

  bool offer(const Take& take, std::int64_t oldest) override {
    const auto forget = [&store = store_, uid = uid_](std::int64_t entries) {
      store.post(
          [uid, entries](SQLite::Database& database) { forget_before(database, uid, entries); },
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
  // False where the session was deleted.
  static bool replace(SQLite::Database& database, const std::string& uid,
                      const std::string& progress) {
    SQLite::Statement update(database,
                             "UPDATE progress SET record = ?, checksum = ? WHERE uid = ?");
    update.bind(1, progress.data(), static_cast<int>(progress.size()));
    update.bind(2, checksum(uid, progress));
    update.bind(3, uid);
    return update.exec() == 1;
  }
  static void add(SQLite::Database& database, const std::string& uid, std::int64_t number,
                  const std::string& record) {
    SQLite::Statement insert(database, "INSERT INTO entry VALUES (?, ?, ?, ?)");
    insert.bind(1, uid);
    insert.bind(2, number);
    insert.bind(3, record.data(), static_cast<int>(record.size()));
    insert.bind(4, checksum(entry_key(uid, number), record));
    insert.exec();
  }

  // A short log stays whole: it is enough without any snapshot.
  static void forget_before(SQLite::Database& database, const std::string& uid,
                            std::int64_t number) {
    SQLite::Statement first(database, "SELECT MIN(number) FROM entry WHERE uid = ?");
    first.bind(1, uid);
    if (!first.executeStep() || number - first.getColumn(0).getInt64() < records::kFewEntries)
      return;
    SQLite::Statement erase(database, "DELETE FROM entry WHERE uid = ? AND number < ?");
    erase.bind(1, uid);
    erase.bind(2, number);
    erase.exec();
  }

  SqliteStore& store_;
  const std::string uid_;
  const std::shared_ptr<std::int64_t> entries_;  // of the log
};

std::unique_ptr<SessionLog> SqliteStore::log_of(const std::string& uid, std::int64_t entries) {
  return std::make_unique<Log>(*this, uid, entries);
}

bool SqliteStore::has_others() const {
  std::lock_guard lock(mutex_);
  return !let_go_.empty();
}

void SqliteStore::let_go(const SessionIdentity& identity) {
  std::lock_guard lock(mutex_);
  let_go_.emplace(identity.id, identity);
}

Claim SqliteStore::claim(const std::string& id) {
  std::string uid;
  {
    std::lock_guard lock(mutex_);
    const auto found = let_go_.find(id);
    if (found == let_go_.end()) return {};
    uid = found->second.uid;
  }
  Claim claim;
  carry_out([&](SQLite::Database& database) {
    SQLite::Statement row(database, "SELECT record, checksum FROM session WHERE uid = ?");
    row.bind(1, uid);
    records::Row session;
    try {
      if (!row.executeStep()) throw StoreError("it is gone");
      session = {blob(row.getColumn(0)), row.getColumn(1).getInt64()};
      claim = load_session(uid, id, session);
    } catch (const StoreError& error) {
      claim = DamagedSession{id, uid, error.what(), records::owner_of(uid, session)};
    }
  });
  std::lock_guard lock(mutex_);
  let_go_.erase(id);
  return claim;
}

std::vector<ListedSession> SqliteStore::list(const std::string& after, std::size_t count,
                                             const std::optional<std::string>& owner) {
  std::vector<ListedSession> sessions;
  carry_out([&](SQLite::Database& database) {
    SQLite::Statement row(database,
                          "SELECT uid, record, checksum FROM session WHERE id > ? ORDER BY id");
    row.bind(1, after);
    while (sessions.size() < count && row.executeStep()) {
      auto session = records::listed(row.getColumn(0).getString(),
                                     {blob(row.getColumn(1)), row.getColumn(2).getInt64()});
      if (session && (!owner || session->identity.owner == *owner))
        sessions.push_back(*std::move(session));
    }
  });
  return sessions;
}

// Waits until the thread has done it.
void SqliteStore::carry_out(Work work) {
  std::promise<std::string> done;
  post(std::move(work), [&](const std::string& error) { done.set_value(error); });
  const std::string error = done.get_future().get();
  if (!error.empty()) throw StoreError(error);
}

// What kept all of them from being written, if anything.
std::string SqliteStore::commit(const std::deque<Job>& jobs) try {
  SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
  for (const auto& job : jobs) job.work(database_);
  transaction.commit();
  return {};
} catch (const SQLite::Exception& error) {
  spdlog::error("{}", text_of(path_, error));
  return text_of(path_, error);
}

}  // namespace

std::unique_ptr<SessionStore> open_sqlite_store(const std::string& directory) {
  return std::make_unique<SqliteStore>(directory);
}

}  // namespace weft
