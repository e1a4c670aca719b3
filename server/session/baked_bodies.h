#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "core/contact/body.h"

namespace weft {

// Bodies as they were baked, for all scenes that have the same. They are kept after the last scene
// has gone, until they take more than a bound: those that were asked for longest ago are let go
// then, and stay shared while a scene has them. Thread-safe.
class BakedBodies {
 public:
  explicit BakedBodies(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  // The body that was baked from this key before; whoever asks while it is baked waits for that.
  // key: all that decides what `bake` makes, but for the paths of problems. What cannot be baked is
  // not kept.
  MadeBody get(const std::string& key, const std::function<MadeBody()>& bake);

  // Of those that are kept, with their keys.
  std::size_t kept_bytes() const;

 private:
  struct Entry {
    bool is_baking = false;
    std::weak_ptr<const Body> body;
    std::shared_ptr<const Body> kept;
    std::size_t bytes = 0;
    std::uint64_t asked = 0;  // the later, the larger
  };
  void keep(Entry& entry, const std::string& key, const std::shared_ptr<const Body>& body);
  void let_go();

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable baked_;
  std::map<std::string, Entry> entries_;
  std::size_t kept_bytes_ = 0;
  std::uint64_t asked_ = 0;
};

}  // namespace weft
