#pragma once

#include <string>
#include <string_view>

#include "tests/support/temporary_directory.h"

namespace weft {

// A recording in a place of its own, and all that is done with recordings.
class Scratch {
 public:
  std::string file() const { return directory_.path("it.weft"); }
  void write(std::string_view bytes) const;
  // Verifies and exports it; a Problem is an answer too.
  void use() const;

 private:
  testing::TemporaryDirectory directory_;
};

}  // namespace weft
