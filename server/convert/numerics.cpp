#include "server/convert/numerics.h"

#include <sstream>

#include "core/fingerprint.h"

namespace weft {

std::string numerics_id() {
  static const std::string id = [] {
    std::ostringstream text;
    text << "weft-" WEFT_VERSION "-" << std::hex << fingerprint();
    return text.str();
  }();
  return id;
}

}  // namespace weft
