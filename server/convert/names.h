#pragma once

#include <optional>
#include <string>

// Resource names: "sessions/{session}", "sessions/{session}/snapshots/{snapshot}", "assets/{hash}".
namespace weft {

std::string session_name(const std::string& id);

// The id in such a name; empty where it is none.
std::string id_of(const std::string& name);

// 1 to 63 characters of [a-z0-9-], beginning with a letter; of snapshots, too.
bool is_session_id(const std::string& id);

std::string snapshot_name(const std::string& session_id, const std::string& id);

// The parts of a snapshot's name.
struct SnapshotName {
  std::string session;  // "sessions/{session}"
  std::string id;
};
// nullopt where the name is none.
std::optional<SnapshotName> read_snapshot_name(const std::string& name);

std::string asset_name(const std::string& hash);

// The hash in such a name, 64 hexadecimal digits in small letters; empty where it is none.
std::string hash_of(const std::string& name);

// An id that nobody will guess to be taken.
std::string make_session_id();

}  // namespace weft
