#include "client/recording/writer.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <filesystem>

#include "client/output/json.h"
#include "client/problem.h"
#include "client/recording/layout.h"

namespace weft::client {
namespace {

constexpr std::chrono::milliseconds kCommitInterval{500};
constexpr std::size_t kCommitBytes = 32 << 20;

Database create(const std::string& path, bool replace) {
  if (!replace && std::filesystem::exists(path))
    throw unwritable(path, "the file exists; --force replaces it");
  for (const char* suffix : {"", "-journal"}) std::filesystem::remove(path + suffix);
  Database database(path, Database::Access::kCreate);
  // a rollback journal, and no page written before its commit: the file alone is a whole recording
  database.execute(
      "PRAGMA journal_mode = DELETE; PRAGMA synchronous = NORMAL; PRAGMA cache_spill = 0");
  return database;
}

void write_triangles(Database& database, const std::string& uid, const Topology& topology,
                     const Assets& assets) {
  database.execute(kTriangleTables);
  for (std::size_t sheet = 0; sheet < topology.size(); ++sheet) {
    const std::string mesh = topology[sheet].SerializeAsString();
    const auto number = static_cast<std::int64_t>(sheet);
    database.prepare("INSERT INTO topology VALUES (?, ?, ?)")
        .bind(1, number)
        .bind_bytes(2, mesh)
        .bind(3, checksum_of_frame(uid, number, mesh))
        .step();
  }
  for (const auto& [name, data] : assets) {
    database.prepare("INSERT INTO assets VALUES (?, ?)")
        .bind_text(1, name)
        .bind_bytes(2, data)
        .step();
  }
}

void describe(Database& database, const v1::Scene& scene, const v1::StreamHeader& header,
              const Topology& topology, const Assets& assets) {
  const std::string scene_json = to_json(scene, Defaults::kLeftOut).dump();
  const std::string header_json = to_json(header, Defaults::kLeftOut).dump();
  database.execute(
      fmt::format("BEGIN; PRAGMA application_id = {}; PRAGMA user_version = {}; {}", kRecordingId,
                  needs_topology(header) ? kTrianglesVersion : kGridsVersion, kRecordingTables)
          .c_str());
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  const std::string recorded_at = fmt::format("{:%FT%TZ}", fmt::gmtime(now));
  database.prepare("INSERT INTO recording VALUES (?, ?, ?, ?, ?)")
      .bind_text(1, WEFT_VERSION)
      .bind_text(2, recorded_at)
      .bind_text(3, scene_json)
      .bind_text(4, header_json)
      .bind(5, checksum_of({WEFT_VERSION, recorded_at, scene_json, header_json}))
      .step();
  const std::int64_t none = header.start_frame() - 1;
  database.prepare("INSERT INTO extent VALUES (?, ?)")
      .bind(1, none)
      .bind(2, checksum_of_frame(header.uid(), none))
      .step();
  if (needs_topology(header) || !assets.empty())
    write_triangles(database, header.uid(), topology, assets);
  database.execute("COMMIT");
}

}  // namespace

RecordingWriter::RecordingWriter(const std::string& path, bool replace, const v1::Scene& scene,
                                 const v1::StreamHeader& header, const Topology& topology,
                                 const Assets& assets)
    : uid_(header.uid()),
      last_frame_(header.start_frame() - 1),
      database_(create(path, replace)),
      insert_((describe(database_, scene, header, topology, assets),
               database_.prepare("INSERT INTO frames VALUES (?, ?, ?, ?)"))),
      extend_(database_.prepare("UPDATE extent SET last_frame = ?, checksum = ?")),
      last_commit_(Clock::now()) {}

RecordingWriter::~RecordingWriter() {
  try {
    commit();
  } catch (const Problem&) {
    // the frames committed before stay readable
  }
}

void RecordingWriter::add(const v1::Frame& frame) {
  const std::string bytes = frame.SerializeAsString();
  if (!std::exchange(pending_, true)) database_.execute("BEGIN");
  insert_.bind(1, frame.number())
      .bind(2, frame.time_s())
      .bind_bytes(3, bytes)
      .bind(4, checksum_of_frame(uid_, frame.number(), bytes))
      .step();
  insert_.reset();
  last_frame_ = frame.number();

  pending_bytes_ += bytes.size();
  if (pending_bytes_ > kCommitBytes || Clock::now() - last_commit_ > kCommitInterval) commit();
}

void RecordingWriter::commit() {
  if (std::exchange(pending_, false)) {
    extend_.bind(1, last_frame_).bind(2, checksum_of_frame(uid_, last_frame_)).step();
    extend_.reset();
    database_.execute("COMMIT");
  }
  pending_bytes_ = 0;
  last_commit_ = Clock::now();
}

void add_verdict(const std::string& path, const v1::Verdict& verdict) {
  Database database(path, Database::Access::kCreate);
  const std::string bytes = verdict.SerializeAsString();
  database.execute((std::string("BEGIN; ") + kVerdictTable).c_str());
  database.prepare("INSERT INTO verdict VALUES (?, ?)")
      .bind_bytes(1, bytes)
      .bind(2, checksum_of({bytes}))
      .step();
  database.execute("COMMIT");
}

}  // namespace weft::client
