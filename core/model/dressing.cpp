#include "core/model/dressing.h"

#include <algorithm>

namespace weft {

double Dressing::end() const {
  double last = 0;
  for (const Hold& hold : holds) last = std::max(last, hold.until);
  return close + std::max(settle, last);
}

DressingState dressing_at(const Dressing& dressing, double time) {
  const auto share = [](double part, double whole) {
    return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : part < 0 ? 0.0 : 1.0;
  };
  const double closed = share(time, dressing.close);
  const double settled = share(time - dressing.close, dressing.settle);
  return {closed * closed * (3 - 2 * closed), settled, settled, (1 - settled) * dressing.drag,
          (1 - settled) * dressing.deflate};
}

}  // namespace weft
