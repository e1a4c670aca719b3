#include "server/store/assets.h"

#include <openssl/sha.h>

#include <array>
#include <random>
#include <utility>

#include "server/store/store.h"

namespace weft {
namespace {

using std::chrono::microseconds;
using Bytes = Statements::Bytes;
using Row = Statements::Row;

// Of what asset_of() reads.
const std::string kSelect =
    "SELECT hash, principal, size, received, content, made, facts FROM weft.asset a ";

std::int64_t number(const Statements::Value& value) { return std::get<std::int64_t>(value); }
const std::string& text(const Statements::Value& value) { return std::get<std::string>(value); }

std::int64_t stamp(Assets::Time time) {
  return std::chrono::duration_cast<microseconds>(time.time_since_epoch()).count();
}

KeptAsset asset_of(const Row& row) {
  KeptAsset asset{text(row[0]), text(row[1]), number(row[2]), number(row[3]), text(row[4]), {}, {}};
  if (const std::int64_t made = number(row[5]); made > 0) {
    asset.create_time = Assets::Time(microseconds(made));
    asset.facts = std::get<Bytes>(row[6]).value;
  }
  return asset;
}

std::optional<KeptAsset> first_of(const std::vector<Row>& rows) {
  return rows.empty() ? std::nullopt : std::optional(asset_of(rows.front()));
}

std::optional<KeptAsset> select(Statements& statements, const std::string& hash,
                                const std::string& owner) {
  return first_of(statements.run(kSelect + "WHERE hash = $1 AND principal = $2", {hash, owner}));
}

std::optional<KeptAsset> select_any(Statements& statements, const std::string& hash) {
  return first_of(
      statements.run(kSelect + "WHERE hash = $1 ORDER BY made DESC, principal LIMIT 1", {hash}));
}

// 128 random bits.
std::string new_content() {
  std::random_device random;
  std::string name;
  for (int i = 0; i < 32; ++i) name += "0123456789abcdef"[random() % 16];
  return name;
}

void insert(Statements& statements, const KeptAsset& asset, Assets::Time now) {
  statements.run(
      "INSERT INTO weft.asset VALUES ($1, $2, $3, $4, $5, $6, $7, $8)",
      {asset.hash, asset.owner, asset.size, asset.received, asset.content,
       asset.create_time ? stamp(*asset.create_time) : 0, Bytes{asset.facts}, stamp(now)});
}

void insert_piece(Statements& statements, const std::string& content, std::int64_t offset,
                  std::string data) {
  statements.run("INSERT INTO weft.asset_piece VALUES ($1, $2, $3)",
                 {content, offset / Assets::kPiece, Bytes{std::move(data)}});
}

// Forgets the asset, and its bytes where nobody else has them.
void remove(Statements& statements, const KeptAsset& asset) {
  statements.run("DELETE FROM weft.asset WHERE hash = $1 AND principal = $2",
                 {asset.hash, asset.owner});
  statements.run(
      "DELETE FROM weft.asset_piece WHERE content = $1 "
      "AND NOT EXISTS (SELECT 1 FROM weft.asset WHERE content = $1)",
      {asset.content});
}

// What is in the way of so many bytes more.
std::optional<Quota::Excess> excess(Statements& statements, const std::string& owner,
                                    std::int64_t size, const Limits& limits) {
  const auto check = [&](const char* name, std::int64_t most,
                         std::int64_t held) -> std::optional<Quota::Excess> {
    if (size <= most - held) return std::nullopt;
    return Quota::Excess{{name, most}, size > most};
  };
  if (const auto found = check("asset_bytes", limits.max_asset_bytes, 0)) return found;
  const auto held = statements.run(
      "SELECT CAST(coalesce(sum(size), 0) AS BIGINT), CAST(coalesce(sum(CASE WHEN principal = $1 "
      "THEN size ELSE 0 END), 0) AS BIGINT) FROM weft.asset",
      {owner});
  if (const auto found =
          check("total_asset_bytes", limits.max_total_asset_bytes, number(held[0][0])))
    return found;
  return check("asset_bytes_per_principal", limits.max_asset_bytes_per_principal,
               number(held[0][1]));
}

void touch(Statements& statements, const KeptAsset& asset, Assets::Time now) {
  statements.run("UPDATE weft.asset SET unused_since = $3 WHERE hash = $1 AND principal = $2",
                 {asset.hash, asset.owner, stamp(now)});
}

}  // namespace

std::string sha256(const std::string& bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash{};
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), hash.data());
  std::string digits;
  for (const unsigned char byte : hash) {
    digits += "0123456789abcdef"[byte >> 4];
    digits += "0123456789abcdef"[byte & 15];
  }
  return digits;
}

std::optional<KeptAsset> Assets::find(const std::string& hash, const std::string& owner) {
  std::optional<KeptAsset> found;
  tables_->read([&](Statements& statements) { found = select(statements, hash, owner); });
  return found;
}

std::optional<KeptAsset> Assets::find_any(const std::string& hash) {
  std::optional<KeptAsset> found;
  tables_->read([&](Statements& statements) { found = select_any(statements, hash); });
  return found;
}

std::vector<KeptAsset> Assets::list(const std::string& after_hash, const std::string& after_owner,
                                    std::size_t count, const std::optional<std::string>& owner) {
  std::vector<KeptAsset> assets;
  tables_->read([&](Statements& statements) {
    assets.clear();
    for (const Row& row : statements.run(
             kSelect +
                 "WHERE (hash > $1 OR (hash = $1 AND principal > $2)) "
                 "AND (CAST($3 AS BIGINT) = 1 OR principal = $4) ORDER BY hash, principal LIMIT $5",
             {after_hash, after_owner, std::int64_t{owner ? 0 : 1}, owner.value_or(""),
              static_cast<std::int64_t>(count)}))
      assets.push_back(asset_of(row));
  });
  return assets;
}

std::variant<KeptAsset, Quota::Excess> Assets::begin(const std::string& hash,
                                                     const std::string& owner, std::int64_t size,
                                                     const Limits& limits, Time now) {
  std::variant<KeptAsset, Quota::Excess> begun;
  tables_->write([&](Statements& statements) {
    if (const auto found = select(statements, hash, owner)) {
      begun = *found;
      if (found->create_time || found->size == size) return touch(statements, *found, now);
      remove(statements, *found);  // what it was said to be was wrong
    }
    if (const auto bound = excess(statements, owner, size, limits)) {
      begun = *bound;
      return;
    }
    const KeptAsset fresh{hash, owner, size, 0, new_content(), {}, {}};
    insert(statements, fresh, now);
    begun = fresh;
  });
  return begun;
}

std::int64_t Assets::append(const KeptAsset& asset, const std::string& data, Time now) {
  std::int64_t received = 0;
  tables_->write([&](Statements& statements) {
    const auto rows = statements.run(
        "UPDATE weft.asset SET received = received + $1, unused_since = $2 WHERE hash = $3 AND "
        "principal = $4 AND content = $5 AND received = $6 AND made = 0 RETURNING received",
        {static_cast<std::int64_t>(data.size()), stamp(now), asset.hash, asset.owner, asset.content,
         asset.received});
    if (!rows.empty()) {
      received = number(rows[0][0]);
      return insert_piece(statements, asset.content, asset.received, data);
    }
    const auto found = select(statements, asset.hash, asset.owner);
    received = found ? found->received : 0;
  });
  return received;
}

void Assets::finish(const KeptAsset& asset, const std::string& facts, Time now) {
  tables_->write([&](Statements& statements) {
    const auto found = select(statements, asset.hash, asset.owner);
    if (!found || found->content != asset.content) throw StoreError("the upload is gone");
    if (found->create_time) return;
    KeptAsset whole = *found;
    if (const auto other = select_any(statements, asset.hash); other && other->create_time)
      whole.content = other->content;
    whole.create_time = now;
    whole.facts = facts;
    statements.run("DELETE FROM weft.asset WHERE hash = $1 AND principal = $2",
                   {asset.hash, asset.owner});
    insert(statements, whole, now);
    if (whole.content != asset.content)
      statements.run("DELETE FROM weft.asset_piece WHERE content = $1", {asset.content});
  });
}

void Assets::drop(const KeptAsset& asset) {
  tables_->write([&](Statements& statements) {
    const auto found = select(statements, asset.hash, asset.owner);
    if (found && found->content == asset.content && !found->create_time) remove(statements, *found);
  });
}

std::optional<Quota::Excess> Assets::put(const std::string& hash, const std::string& owner,
                                         const std::string& bytes, const std::string& facts,
                                         const Limits& limits, Time now) {
  std::optional<Quota::Excess> bound;
  tables_->write([&](Statements& statements) {
    bound.reset();
    if (const auto found = select(statements, hash, owner)) {
      if (found->create_time) return touch(statements, *found, now);
      remove(statements, *found);  // what comes now is all of it
    }
    const auto size = static_cast<std::int64_t>(bytes.size());
    if ((bound = excess(statements, owner, size, limits))) return;
    const auto other = select_any(statements, hash);
    const bool there = other && other->create_time;
    const KeptAsset whole{hash, owner, size, size, there ? other->content : new_content(),
                          now,  facts};
    insert(statements, whole, now);
    for (std::int64_t at = 0; !there && at < size; at += kPiece)
      insert_piece(statements, whole.content, at,
                   bytes.substr(static_cast<std::size_t>(at), kPiece));
  });
  return bound;
}

bool Assets::own(const std::string& hash, const std::string& owner, Time now) {
  bool there = false;
  tables_->write([&](Statements& statements) {
    const auto own = select(statements, hash, owner);
    if ((there = own && own->create_time)) return touch(statements, *own, now);
    auto other = select_any(statements, hash);
    if (!(there = other && other->create_time)) return;
    if (own) remove(statements, *own);
    other->owner = owner;
    insert(statements, *other, now);
  });
  return there;
}

std::string Assets::piece(const KeptAsset& asset, std::int64_t at) {
  std::string data;
  tables_->read([&](Statements& statements) {
    const auto rows =
        statements.run("SELECT data FROM weft.asset_piece WHERE content = $1 AND number = $2",
                       {asset.content, at});
    data = rows.empty() ? std::string() : std::get<Bytes>(rows[0][0]).value;
  });
  return data;
}

std::string Assets::bytes(const KeptAsset& asset) {
  std::string all;
  all.reserve(static_cast<std::size_t>(asset.size));
  for (std::int64_t at = 0; at * kPiece < asset.size; ++at) all += piece(asset, at);
  return all;
}

bool Assets::erase(const KeptAsset& asset) {
  bool used = false;
  tables_->write([&](Statements& statements) {
    used = !statements
                .run("SELECT uid FROM weft.asset_use WHERE hash = $1 AND principal = $2 LIMIT 1",
                     {asset.hash, asset.owner})
                .empty();
    if (used) return;
    if (const auto found = select(statements, asset.hash, asset.owner)) remove(statements, *found);
  });
  return !used;
}

void Assets::sweep(Time unused_since) {
  tables_->write([&](Statements& statements) {
    for (const Row& row : statements.run(
             kSelect + "WHERE unused_since < $1 AND NOT EXISTS (SELECT 1 FROM "
                       "weft.asset_use u WHERE u.hash = a.hash AND u.principal = a.principal)",
             {stamp(unused_since)}))
      remove(statements, asset_of(row));
  });
}

Assets::Total Assets::total() {
  Total total;
  tables_->read([&](Statements& statements) {
    const auto rows = statements.run(
        "SELECT count(*), CAST(coalesce(sum(size), 0) AS BIGINT) FROM weft.asset", {});
    total = {number(rows[0][0]), number(rows[0][1])};
  });
  return total;
}

void Assets::use(const std::string& uid, const std::string& owner,
                 const std::set<std::string>& hashes) {
  if (hashes.empty()) return;
  tables_->write([&](Statements& statements) { use(statements, uid, owner, hashes); });
}

void Assets::use(Statements& statements, const std::string& uid, const std::string& owner,
                 const std::set<std::string>& hashes) {
  for (const std::string& hash : hashes) {
    const auto found = select(statements, hash, owner);
    if (!found || !found->create_time) throw StoreError("assets/" + hash + " is gone");
    statements.run(
        "INSERT INTO weft.asset_use VALUES ($1, $2, $3) ON CONFLICT (uid, hash) DO NOTHING",
        {uid, hash, owner});
  }
}

void Assets::release(const std::string& uid, Time now) {
  tables_->write([&](Statements& statements) { release(statements, uid, now); });
}

void Assets::release(Statements& statements, const std::string& uid, Time now) {
  statements.run(
      "UPDATE weft.asset SET unused_since = $2 WHERE EXISTS (SELECT 1 FROM weft.asset_use u "
      "WHERE u.uid = $1 AND u.hash = asset.hash AND u.principal = asset.principal)",
      {uid, stamp(now)});
  statements.run("DELETE FROM weft.asset_use WHERE uid = $1", {uid});
}

void Assets::keep_only(const std::set<std::string>& uids, Time now) {
  tables_->write([&](Statements& statements) {
    for (const Row& row : statements.run("SELECT DISTINCT uid FROM weft.asset_use", {}))
      if (!uids.contains(text(row[0]))) release(statements, text(row[0]), now);
  });
}

}  // namespace weft
