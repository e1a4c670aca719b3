#pragma once

#include <string>
#include <vector>

#include "server/store/postgres_connection.h"
#include "server/store/snapshots.h"
#include "server/store/tenures.h"

namespace weft {

// A table of PostgreSQL, whose rows are written under the tenure of their session.
class SnapshotTable final : public SnapshotShelf {
 public:
  SnapshotTable(const std::string& url, const Tenures& tenures);

  std::vector<Item> list(const std::string& uid, Folder folder) override;
  void write(const std::string& uid, const std::string& name, const std::string& bytes) override;
  std::string read(const std::string& uid, const std::string& name) override;
  void remove(const std::string& uid, const std::string& name) override;
  void remove_all(const std::string& /*uid*/) override {}  // they go with their session
  std::string place_of(const std::string& uid, const std::string& name) const override;

 private:
  PostgresConnection connection_;
  const Tenures& tenures_;
};

}  // namespace weft
