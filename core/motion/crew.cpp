#include "core/motion/crew.h"

namespace weft {
namespace {

class NoCrew : public Crew {
 public:
  int hands() const override { return 1; }
  void run(int parts, const std::function<void(int)>& part) override {
    for (int i = 0; i < parts; ++i) part(i);
  }
};

}  // namespace

Crew& no_crew() {
  static NoCrew alone;
  return alone;
}

}  // namespace weft
