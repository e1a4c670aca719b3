#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/store/assets.h"
#include "server/store/store.h"
#include "weft/v1/mesh.pb.h"

// What is kept, as bytes (weft.storage.v1). Decoding throws StoreError for bytes that say nothing
// which this version understands.
namespace weft::records {

// Entries of a log that are not worth forgetting.
inline constexpr std::int64_t kFewEntries = 256;

struct Progress {
  std::int64_t entries = 0;
  PublishLimit limit;
};

std::string encode(const KeptSession& session);
std::string encode(const Progress& progress);
std::string encode(const LogEntry& entry);
std::string encode(const std::string& uid, const SessionSnapshot& snapshot);

// With the meshes of the assets that its scene names, which are its owner's.
KeptSession decode_session(const std::string& bytes, Assets& assets);
Progress decode_progress(const std::string& bytes);
LogEntry decode_entry(const std::string& bytes);
SessionSnapshot decode_snapshot(const std::string& uid, const std::string& bytes);

// A record as a store has it.
struct Row {
  std::string record;
  std::int64_t checksum = 0;
};
struct NumberedRow : Row {
  std::int64_t number = 0;
};

// A session of its rows, entries in order of number, without its named snapshots. Throws StoreError
// for what cannot be trusted.
LeftSession assemble(const std::string& uid, const std::string& id, const Row& session,
                     const Row& progress, const std::vector<NumberedRow>& entries, Assets& assets);

// The mesh of a whole asset. Throws StoreError where it is damaged.
std::shared_ptr<const v1::MeshData> read_mesh(Assets& assets, const KeptAsset& asset);

// What lists show of a session, where the row can be trusted.
std::optional<ListedSession> listed(const std::string& uid, const Row& session);

// Its principal, where so much can be trusted.
std::optional<std::string> owner_of(const std::string& uid, const Row& session);

// What the checksum of an entry covers beside the record.
std::string entry_key(const std::string& uid, std::int64_t number);

std::chrono::system_clock::time_point time_of(const google::protobuf::Timestamp& timestamp);

// CRC-32 of the record and what it is filed under.
std::uint32_t checksum(const std::string& key, const std::string& record);

}  // namespace weft::records
