#pragma once

#include <chrono>

namespace weft::stress {

// How the disk of a program behaves that runs with libweft-bad-disk: the first byte of the file
// that WEFT_BAD_DISK names.
enum class Disk : char {
  kGood = 'g',
  kFull = 'f',      // nothing more can be written
  kCrowded = 'c',   // no file can grow
  kReadOnly = 'r',  // nor opened for writing, renamed or removed
  kSlow = 's',      // what was written takes kSync to reach it
};

constexpr std::chrono::milliseconds kSync{100};

}  // namespace weft::stress
