#include "server/convert/numerics.h"

#include <fmt/format.h>

#include "core/fingerprint.h"

namespace weft {

std::string numerics_id() {
  static const std::string id = fmt::format("weft-{}-{:016x}", WEFT_VERSION, fingerprint());
  return id;
}

}  // namespace weft
