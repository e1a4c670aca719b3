#pragma once

#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace weft::client {

// A recording is one SQLite file: what was recorded, once, and a row for every frame.
inline constexpr std::int64_t kRecordingId = 0x57454654;  // "WEFT", application_id of the file
inline constexpr std::int64_t kRecordingVersion = 1;      // user_version of the file
inline constexpr const char* kRecordingTables = R"(
  CREATE TABLE recording (
    weft_version TEXT NOT NULL,
    recorded_at TEXT NOT NULL,    -- UTC
    scene TEXT NOT NULL,          -- JSON of weft.v1.Scene
    header TEXT NOT NULL,         -- JSON of weft.v1.StreamHeader
    checksum INTEGER NOT NULL);   -- CRC-32 of the columns before
  CREATE TABLE frames (
    number INTEGER PRIMARY KEY,
    time_s REAL NOT NULL,
    frame BLOB NOT NULL,          -- weft.v1.Frame
    checksum INTEGER NOT NULL);   -- CRC-32 of the session's uid, the number (8 bytes, little-endian) and the frame
)";

std::int64_t checksum_of(std::initializer_list<std::string_view> parts);
std::int64_t checksum_of_frame(std::string_view uid, std::int64_t number, std::string_view frame);

}  // namespace weft::client
