#include "server/store/snapshot_table.h"

#include <spdlog/spdlog.h>

#include <cstdint>
#include <optional>
#include <pqxx/pqxx>

#include "server/store/postgres_values.h"
#include "server/store/store.h"

namespace weft {
namespace {

const std::vector<PostgresConnection::Statement> kStatements = {
    {"write",
     "INSERT INTO weft.snapshot SELECT uid, $2::text, $3::bytea FROM weft.session "
     "WHERE uid = $1 AND owner = $4 AND epoch = $5 "
     "ON CONFLICT (uid, name) DO UPDATE SET content = excluded.content"}};

}  // namespace

SnapshotTable::SnapshotTable(const std::string& url, const Tenures& tenures)
    : connection_(url, kStatements), tenures_(tenures) {}

std::vector<SnapshotShelf::Item> SnapshotTable::list(const std::string& uid, Folder folder) {
  const bool named = folder == Folder::kNamed;
  std::vector<Item> items;
  connection_.run([&](pqxx::work& transaction) {
    items.clear();
    for (const auto& row :
         transaction.exec_params("SELECT name, length(content) FROM weft.snapshot WHERE uid = $1 "
                                 "AND starts_with(name, 'named/') = $2",
                                 uid, named)) {
      items.push_back({row[0].as<std::string>().substr(named ? 6 : 0), number_of(row[1])});
    }
  });
  return items;
}

void SnapshotTable::write(const std::string& uid, const std::string& name,
                          const std::string& bytes) {
  const Tenure tenure = tenures_.of(uid);
  std::size_t written = 0;
  connection_.run([&](pqxx::work& transaction) {
    written =
        transaction.exec_prepared("write", uid, name, binary(bytes), tenure.owner, tenure.epoch)
            .affected_rows();
  });
  if (written == 0) throw StoreError("the session is another server's now, or deleted");
}

std::string SnapshotTable::read(const std::string& uid, const std::string& name) {
  std::optional<std::string> content;
  connection_.run([&](pqxx::work& transaction) {
    const auto rows = transaction.exec_params(
        "SELECT content FROM weft.snapshot WHERE uid = $1 AND name = $2", uid, name);
    if (!rows.empty()) content = bytes_of(rows[0][0]);
  });
  if (!content) throw StoreError("it is gone");
  return *content;
}

void SnapshotTable::remove(const std::string& uid, const std::string& name) try {
  const Tenure tenure = tenures_.of(uid);
  connection_.run([&](pqxx::work& transaction) {
    transaction.exec_params(
        "DELETE FROM weft.snapshot n USING weft.session s WHERE n.uid = $1 AND n.name = $2 "
        "AND s.uid = $1 AND s.owner = $3 AND s.epoch = $4",
        uid, name, tenure.owner, tenure.epoch);
  });
} catch (const StoreError& error) {
  spdlog::warn("{} cannot be removed: {}", place_of(uid, name), error.what());
}

std::string SnapshotTable::place_of(const std::string& uid, const std::string& name) const {
  return "snapshot " + name + " of session " + uid + " in " + connection_.place();
}

}  // namespace weft
