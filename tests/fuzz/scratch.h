#pragma once

#include <string>
#include <string_view>

namespace weft {

// A recording in a place of its own, and all that is done with recordings.
class Scratch {
 public:
  Scratch();
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  std::string file() const { return directory_ + "/it.weft"; }
  void write(std::string_view bytes) const;
  // Verifies and exports it; a Problem is an answer too.
  void use() const;

 private:
  std::string directory_;
};

}  // namespace weft
