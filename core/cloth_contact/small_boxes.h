#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <span>
#include <vector>

namespace weft {

// Numbers of a particle and a triangle, or of two edges, or of two triangles.
struct ClothPair {
  int first = 0, second = 0;
  auto operator<=>(const ClothPair&) const = default;
};

// A box in single precision: its low corner, 0, its high corner with the other sign, 0, m.
struct alignas(32) SmallBox {
  std::array<float, 8> side;
};

// Boxes with numbers; which are near each other is looked up in vectors.
class SmallBoxes {
 public:
  // Particles of some parts of a cloth, as many of each: 1 to 3. Parts are numbered from `first`
  // on.
  struct Parts {
    const int* particles;
    int of_each, count, first;
  };
  // Of boxes around each of these those no farther from one than `reach` along any axis, m, at
  // least 0. places: of particles, (4 x particles) m, aligned; fourth components are 0.
  void choose(const Parts& parts, const float* places, const SmallBox& near, float reach);
  void clear() { size_ = 0; }
  // Numbers of those chosen.
  std::span<int> numbers() { return std::span(number_).first(size_); }
  // Of each of these and each of the others, or each after it, those as near to each other; in
  // `met` until it is used again.
  std::span<const ClothPair> meet(const SmallBoxes& others, bool ascending, float reach,
                                  std::vector<ClothPair>& met) const;

  // For vectors.
  struct Chosen {
    const int* number;
    const SmallBox* box;
    std::size_t size;
  };

 private:
  std::vector<int> number_;
  std::vector<SmallBox> box_;
  std::size_t size_ = 0;  // of what is known in these
};

}  // namespace weft
