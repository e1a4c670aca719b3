#pragma once

#include <string>

// What a weftd of its own process, or a fleet of them, holds under load and faults. Each test is
// one function here and one line of the table that `./dev stress` prints.
namespace weft::stress {

enum class Form { kShort, kLong };

struct Outcome {
  std::string figure;  // what was seen
  std::string hold;    // what is to hold
  bool counts = true;  // nothing lost, doubled, differing, leaked: decides in both forms
  bool bounds = true;  // times, rates and bytes: decide in the long form
};

Outcome lossless(Form form);
Outcome real_time(Form form);
Outcome fan_out(Form form);
Outcome long_frames(Form form);
Outcome contacts(Form form);
Outcome churn(Form form);
Outcome slow_readers(Form form);
Outcome view_age(Form form);
Outcome kills(Form form);
Outcome full_disk(Form form);
Outcome read_only_disk(Form form);
Outcome slow_disk(Form form);
Outcome drain(Form form);
Outcome sizing(Form form);
Outcome fleet_kills(Form form);
Outcome fleet_freezes(Form form);
Outcome fleet_resize(Form form);
Outcome fleet_drain(Form form);
Outcome fleet_database(Form form);
Outcome fleet_full(Form form);
Outcome fleet_reload(Form form);

}  // namespace weft::stress
