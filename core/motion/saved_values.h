#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>

namespace weft {

// Numbers one after the other, as they lie in memory.
class SavedValues {
 public:
  template <class T>
  void put(const T* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  template <class T>
  void put(T value) {
    put(&value, 1);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// The same back, in the order in which they were put. Where fewer are left than are wanted, none
// are taken any more.
class LoadedValues {
 public:
  explicit LoadedValues(const std::string& bytes) : bytes_(bytes) {}

  template <class T>
  void take(T* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<T>);
    enough_ &= count * sizeof(T) <= bytes_.size() - at_;
    if (!enough_ || count == 0) return;
    std::memcpy(values, bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  // Whether there were as many as were wanted, and no more.
  bool all_taken() const { return enough_ && at_ == bytes_.size(); }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
  bool enough_ = true;
};

}  // namespace weft
