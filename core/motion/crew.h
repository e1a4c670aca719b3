#pragma once

#include <functional>

namespace weft {

// Hands that share the work of a step. What they make does not depend on how many they are.
class Crew {
 public:
  virtual ~Crew() = default;
  // How many may work now, at least 1.
  virtual int hands() const = 0;
  // Runs part(0) ... part(parts - 1), perhaps at the same time, and returns when all have returned.
  virtual void run(int parts, const std::function<void(int)>& part) = 0;
};

// The thread that calls, alone.
Crew& no_crew();

}  // namespace weft
