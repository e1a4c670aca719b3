#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "server/store/snapshots.h"

namespace weft {

// A directory for each session, a file for each snapshot.
class SnapshotFiles final : public SnapshotShelf {
 public:
  explicit SnapshotFiles(std::filesystem::path directory);

  std::vector<Item> list(const std::string& uid, Folder folder) override;
  void write(const std::string& uid, const std::string& name, const std::string& bytes) override;
  std::string read(const std::string& uid, const std::string& name) override;
  void remove(const std::string& uid, const std::string& name) override;
  void remove_all(const std::string& uid) override;
  std::string place_of(const std::string& uid, const std::string& name) const override;

  // Removes those of other sessions.
  void keep_only(const std::set<std::string>& uids) const;

 private:
  const std::filesystem::path directory_;
};

}  // namespace weft
