#include "core/motion/aligned_array.h"

#include <sys/mman.h>

#include <new>

namespace weft {

void* allocate_aligned(std::size_t bytes) {
  constexpr std::size_t kVector = 64, kPage = 2 << 20;
  const std::size_t unit = bytes < 2 * kPage ? kVector : kPage;
  const std::size_t size = (bytes + unit - 1) / unit * unit;
  void* const data = std::aligned_alloc(unit, size);
  if (data == nullptr) throw std::bad_alloc();
  if (unit == kPage) madvise(data, size, MADV_HUGEPAGE);  // slower where it is refused
  return data;
}

}  // namespace weft
