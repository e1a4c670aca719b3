#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/session/limits.h"
#include "server/session/quota.h"
#include "server/store/statements.h"

namespace weft {

// In 64 hexadecimal digits.
std::string sha256(const std::string& bytes);

// An asset of a principal's, whole or not.
struct KeptAsset {
  std::string hash;  // SHA-256 of its bytes, 64 hexadecimal digits
  std::string owner;
  std::int64_t size = 0, received = 0;  // bytes in all, and so far
  std::string content;                  // what its bytes are filed under
  std::optional<std::chrono::system_clock::time_point> create_time;  // none: it is not whole
  std::string facts;                                                 // of a whole one
};

// Large values that sessions name. Principals that have the same one share its bytes, and do not
// see that. All of it waits for the store, and throws StoreError. Thread-safe.
class Assets {
 public:
  static constexpr std::int64_t kPiece = 1 << 20;  // bytes of each piece but the last
  using Time = std::chrono::system_clock::time_point;

  explicit Assets(std::unique_ptr<Tables> tables) : tables_(std::move(tables)) {}

  std::optional<KeptAsset> find(const std::string& hash, const std::string& owner);
  // Of any owner, a whole one where there is one.
  std::optional<KeptAsset> find_any(const std::string& hash);
  // In order of hash and owner, at most `count` of those behind the two given; of one owner, or of
  // all.
  std::vector<KeptAsset> list(const std::string& after_hash, const std::string& after_owner,
                              std::size_t count, const std::optional<std::string>& owner);

  // The one that there is, whole or as far as it came, or a new one; or the bound in its way.
  std::variant<KeptAsset, Quota::Excess> begin(const std::string& hash, const std::string& owner,
                                               std::int64_t size, const Limits& limits, Time now);
  // Adds the next bytes to one that is not whole: kPiece, or all that are missing. Answers how many
  // there are then; nothing is added where there were not asset.received of them. 0: it is gone.
  std::int64_t append(const KeptAsset& asset, const std::string& data, Time now);
  // Makes one whole whose bytes are all there.
  void finish(const KeptAsset& asset, const std::string& facts, Time now);
  // Forgets one that is not whole, if it is still there.
  void drop(const KeptAsset& asset);

  // Keeps a whole one. Nothing is done where there is one.
  std::optional<Quota::Excess> put(const std::string& hash, const std::string& owner,
                                   const std::string& bytes, const std::string& facts,
                                   const Limits& limits, Time now);
  // Makes one of another's that is whole the owner's, too, and unused only since now. False where
  // there is none.
  bool own(const std::string& hash, const std::string& owner, Time now);

  // A piece, by its number; empty behind the last.
  std::string piece(const KeptAsset& asset, std::int64_t at);
  // All of them.
  std::string bytes(const KeptAsset& asset);

  // Forgets one that no session uses; false where one does.
  bool erase(const KeptAsset& asset);
  // Forgets those that no session has used since, nor any piece come to.
  void sweep(Time unused_since);

  struct Total {
    std::int64_t count = 0, bytes = 0;
  };
  Total total();

  // Says that a session of this owner's uses these, its own, from now on. Throws StoreError where
  // one is missing.
  void use(const std::string& uid, const std::string& owner, const std::set<std::string>& hashes);
  // Says that a session is gone.
  void release(const std::string& uid, Time now);
  // Releases what sessions use that are not among these.
  void keep_only(const std::set<std::string>& uids, Time now);

  // The same within a transaction.
  static void use(Statements& statements, const std::string& uid, const std::string& owner,
                  const std::set<std::string>& hashes);
  static void release(Statements& statements, const std::string& uid, Time now);

 private:
  const std::unique_ptr<Tables> tables_;
};

}  // namespace weft
