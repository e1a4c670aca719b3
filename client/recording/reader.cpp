#include "client/recording/reader.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include "client/problem.h"
#include "client/recording/layout.h"
#include "client/recording/points.h"

namespace weft::client {
namespace {

std::int64_t pragma(Database& database, std::string_view name) {
  Statement statement = database.prepare(fmt::format("PRAGMA {}", name));
  return statement.step() ? statement.integer(0) : 0;
}

}  // namespace

RecordingReader::RecordingReader(const std::string& path)
    : path_(path), database_(path, Database::Access::kRead) {
  if (pragma(database_, "application_id") != kRecordingId)
    throw malformed(path, "not a recording of weft");
  const std::int64_t version = pragma(database_, "user_version");
  if (version != kGridsVersion && version != kTrianglesVersion)
    throw malformed(path, "made by another version of weft");

  Statement row =
      database_.prepare("SELECT weft_version, recorded_at, scene, header, checksum FROM recording");
  if (!row.step()) throw damaged(path, "it does not say what it holds");
  recorded_at_ = row.bytes(1);
  const std::string scene = row.bytes(2);
  const std::string header = row.bytes(3);
  const bool sound = row.integer(4) == checksum_of({row.bytes(0), recorded_at_, scene, header}) &&
                     google::protobuf::util::JsonStringToMessage(scene, &scene_).ok() &&
                     google::protobuf::util::JsonStringToMessage(header, &header_).ok();
  if (!sound) throw damaged(path, "the checksum of its description is wrong");

  Statement extent = database_.prepare("SELECT last_frame, checksum FROM extent");
  if (!extent.step() || extent.integer(1) != checksum_of_frame(header_.uid(), extent.integer(0)))
    throw damaged(path, "the checksum of its number of frames is wrong");
  last_frame_ = extent.integer(0);
  try {
    particle_count(header_);
  } catch (const Problem& problem) {
    throw damaged(path, problem.what());
  }
  for (auto& sheet : *header_.mutable_sheets()) {  // older ones do not say it of grids
    sheet.set_particle_count(static_cast<std::int32_t>(particle_count(sheet)));
    sheet.set_triangle_count(static_cast<std::int32_t>(triangle_count(sheet)));
  }
  read_topology(version);
}

void RecordingReader::read_topology(std::int64_t version) {
  topology_.resize(static_cast<std::size_t>(header_.sheets_size()));
  for (std::size_t sheet = 0; version == kTrianglesVersion && sheet < topology_.size(); ++sheet) {
    const auto number = static_cast<std::int64_t>(sheet);
    Statement row = database_.prepare("SELECT mesh, checksum FROM topology WHERE sheet = ?");
    const bool there = row.bind(1, number).step();
    const std::string mesh = there ? row.bytes(0) : std::string();
    if (!there || row.integer(1) != checksum_of_frame(header_.uid(), number, mesh) ||
        !topology_[sheet].ParseFromString(mesh)) {
      throw damaged(path_, fmt::format("the checksum of the triangles of sheet {} is wrong",
                                       header_.sheets(static_cast<int>(sheet)).name()));
    }
  }
  if (!is_sound(topology_, header_))
    throw damaged(path_, "the triangles of its sheets are not those that its header names");
}

std::optional<v1::Verdict> RecordingReader::verdict() {
  if (!database_.prepare("SELECT 1 FROM sqlite_master WHERE name = 'verdict'").step())
    return std::nullopt;
  Statement row = database_.prepare("SELECT verdict, checksum FROM verdict");
  v1::Verdict verdict;
  if (!row.step() || row.integer(1) != checksum_of({row.bytes(0)}) ||
      !verdict.ParseFromString(row.bytes(0)))
    throw damaged(path_, "the checksum of its verdict is wrong");
  return verdict;
}

std::int64_t RecordingReader::count_frames() {
  Statement row = database_.prepare("SELECT count(*) FROM frames");
  return row.step() ? row.integer(0) : 0;
}

v1::Frame RecordingReader::read(std::int64_t number) {
  Statement row = database_.prepare("SELECT time_s, frame, checksum FROM frames WHERE number = ?");
  if (!row.bind(1, number).step()) {
    if (number >= first_frame() && number <= last_frame_)
      throw damaged(path_, fmt::format("frame {} is missing", number));
    throw Problem(Exit::kFile, "NOT_FOUND", "FRAME_MISSING",
                  fmt::format("{} has no frame {}", path_, number));
  }
  const std::string bytes = row.bytes(1);
  v1::Frame frame;
  const bool sound = row.integer(2) == checksum_of_frame(header_.uid(), number, bytes) &&
                     frame.ParseFromString(bytes) && frame.number() == number &&
                     frame.time_s() == row.real(0);
  if (!sound)
    throw damaged(
        path_,
        fmt::format("the checksum of frame {} is wrong; weft cut takes out sound ones", number));
  if (!is_whole(frame, header_))
    throw damaged(path_, fmt::format("frame {} is not as long as its header says", number));
  return frame;
}

std::vector<std::pair<std::int64_t, double>> RecordingReader::find_around(double time_s) {
  std::vector<std::pair<std::int64_t, double>> found;
  for (const char* sql :
       {"SELECT number, time_s FROM frames WHERE time_s <= ? ORDER BY number DESC LIMIT 1",
        "SELECT number, time_s FROM frames WHERE time_s > ? ORDER BY number LIMIT 1"}) {
    Statement row = database_.prepare(sql);
    if (row.bind(1, time_s).step()) found.emplace_back(row.integer(0), row.real(1));
  }
  return found;
}

Assets RecordingReader::assets() {
  Assets assets;
  // sheets of triangles have it, and bodies
  if (!database_.prepare("SELECT 1 FROM sqlite_master WHERE name = 'assets'").step()) return assets;
  Statement row = database_.prepare("SELECT name, data FROM assets");
  while (row.step()) {
    const std::string data = row.bytes(1);
    const std::string name = asset_name(data);
    if (row.bytes(0) != name)
      throw damaged(path_, fmt::format("{} is not what its name says", row.bytes(0)));
    assets.emplace(name, data);
  }
  return assets;
}

std::vector<std::string> RecordingReader::find_damage() {
  std::vector<std::string> damage;
  Statement row = database_.prepare("PRAGMA integrity_check(10)");
  while (row.step()) {
    if (const std::string text = row.bytes(0); text != "ok") damage.push_back(text);
  }
  return damage;
}

}  // namespace weft::client
