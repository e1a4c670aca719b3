#include "server/session/baked_bodies.h"

#include <utility>
#include <vector>

namespace weft {
namespace {

template <class Value>
std::size_t bytes_of(const std::vector<Value>& values) {
  return values.size() * sizeof(Value);
}

std::size_t bytes_of(const Body& body) {
  return bytes_of(body.mesh.vertices) + bytes_of(body.mesh.triangles) + bytes_of(body.grid.begin) +
         bytes_of(body.grid.values);
}

}  // namespace

MadeBody BakedBodies::get(const std::string& key, const std::function<MadeBody()>& bake) {
  std::unique_lock lock(mutex_);
  baked_.wait(lock, [&] { return !entries_[key].is_baking; });
  Entry& entry = entries_[key];
  if (auto body = entry.body.lock()) {
    keep(entry, key, body);
    let_go();
    return {std::move(body), {}};
  }

  // others may ask for other bodies meanwhile
  entry.is_baking = true;
  lock.unlock();
  MadeBody made;
  try {
    made = bake();
  } catch (...) {
    lock.lock();
    entries_.erase(key);
    baked_.notify_all();
    throw;
  }
  lock.lock();
  entry.is_baking = false;
  if (made.body) keep(entry, key, made.body);
  let_go();
  baked_.notify_all();
  return made;
}

std::size_t BakedBodies::kept_bytes() const {
  const std::lock_guard lock(mutex_);
  return kept_bytes_;
}

void BakedBodies::keep(Entry& entry, const std::string& key,
                       const std::shared_ptr<const Body>& body) {
  entry.asked = ++asked_;
  if (entry.kept) return;
  entry.body = entry.kept = body;
  entry.bytes = key.size() + bytes_of(*body);
  kept_bytes_ += entry.bytes;
}

void BakedBodies::let_go() {
  while (kept_bytes_ > most_bytes_) {
    Entry* oldest = nullptr;
    for (auto& [key, entry] : entries_)
      if (entry.kept && (oldest == nullptr || entry.asked < oldest->asked)) oldest = &entry;
    oldest->kept.reset();
    kept_bytes_ -= oldest->bytes;
  }
  std::erase_if(entries_, [](const auto& each) {
    return !each.second.is_baking && each.second.body.expired();
  });
}

}  // namespace weft
