#pragma once

#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace weft::client {

// A recording is one SQLite file: what was recorded, once, how far it goes, and a row for every
// frame from the header's start_frame to there. A commit moves both together.
inline constexpr std::int64_t kRecordingId = 0x57454654;  // "WEFT", application_id of the file
// user_version of the file; 2: all sheets are grids, 3: it says the triangles of sheets, too
inline constexpr std::int64_t kGridsVersion = 2, kTrianglesVersion = 3;
inline constexpr const char* kRecordingTables = R"(
  CREATE TABLE recording (
    weft_version TEXT NOT NULL,
    recorded_at TEXT NOT NULL,    -- UTC
    scene TEXT NOT NULL,          -- JSON of weft.v1.Scene
    header TEXT NOT NULL,         -- JSON of weft.v1.StreamHeader
    checksum INTEGER NOT NULL);   -- CRC-32 of the columns before
  CREATE TABLE extent (
    last_frame INTEGER NOT NULL,  -- start_frame - 1: there is none yet
    checksum INTEGER NOT NULL);   -- CRC-32 of the session's uid and last_frame (8 bytes, little-endian)
  CREATE TABLE frames (
    number INTEGER PRIMARY KEY,
    time_s REAL NOT NULL,
    frame BLOB NOT NULL,          -- weft.v1.Frame
    checksum INTEGER NOT NULL);   -- CRC-32 of the session's uid, the number (8 bytes, little-endian) and the frame
)";
inline constexpr const char* kTriangleTables = R"(
  CREATE TABLE topology (         -- of every sheet
    sheet INTEGER PRIMARY KEY,    -- in the header, from 0
    mesh BLOB NOT NULL,           -- weft.v1.MeshData without positions; of a grid it may be empty
    checksum INTEGER NOT NULL);   -- CRC-32 of the session's uid, the sheet (8 bytes, little-endian) and the mesh
  CREATE TABLE assets (           -- that the scene names, as far as the recorder could have them
    name TEXT PRIMARY KEY,        -- "assets/{SHA-256 of the data}"
    data BLOB NOT NULL);          -- weft.v1.MeshData
)";

// Where the session was judged at the last frame.
inline constexpr const char* kVerdictTable = R"(
  CREATE TABLE verdict (
    verdict BLOB NOT NULL,        -- weft.v1.Verdict
    checksum INTEGER NOT NULL);   -- CRC-32 of the column before
)";

std::int64_t checksum_of(std::initializer_list<std::string_view> parts);
// Of the extent: without a frame.
std::int64_t checksum_of_frame(std::string_view uid, std::int64_t number,
                               std::string_view frame = {});

}  // namespace weft::client
