#include "server/convert/names.h"

#include <algorithm>
#include <random>

namespace weft {
namespace {

constexpr std::string_view kCollection = "sessions/", kSnapshots = "/snapshots/",
                           kAssets = "assets/";

}  // namespace

std::string session_name(const std::string& id) { return std::string(kCollection) + id; }

std::string id_of(const std::string& name) {
  return name.starts_with(kCollection) ? name.substr(kCollection.size()) : "";
}

bool is_session_id(const std::string& id) {
  const auto letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !id.empty() && id.size() <= 63 && letter(id.front()) &&
         std::all_of(id.begin(), id.end(),
                     [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-'; });
}

std::string snapshot_name(const std::string& session_id, const std::string& id) {
  return session_name(session_id) + std::string(kSnapshots) + id;
}

std::optional<SnapshotName> read_snapshot_name(const std::string& name) {
  const std::size_t at = name.find(kSnapshots);
  if (at == std::string::npos) return std::nullopt;
  SnapshotName parts{name.substr(0, at), name.substr(at + kSnapshots.size())};
  if (!is_session_id(id_of(parts.session)) || !is_session_id(parts.id)) return std::nullopt;
  return parts;
}

std::string asset_name(const std::string& hash) { return std::string(kAssets) + hash; }

std::string hash_of(const std::string& name) {
  constexpr std::size_t kDigits = 64;
  if (!name.starts_with(kAssets)) return {};
  std::string hash = name.substr(kAssets.size());
  const bool sound =
      hash.size() == kDigits && hash.find_first_not_of("0123456789abcdef") == std::string::npos;
  return sound ? hash : std::string();
}

std::string make_session_id() {
  std::random_device random;
  std::string id = "session-";
  for (int i = 0; i < 10; ++i) id += "0123456789abcdefghijklmnopqrstuvwxyz"[random() % 36];
  return id;
}

}  // namespace weft
