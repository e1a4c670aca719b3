#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/output/json.h"
#include "weft/v1/scene.pb.h"

namespace weft::client {

// What goes on at a time while a garment is put on.
struct Phase {
  std::string name;
  std::optional<double> until_s;  // absent: from then on
};

// One after the other; none where nothing is put on.
std::vector<Phase> phases_of(const v1::Scene& scene);
// As pages have them: name, and until_s where there is one.
Json phases_json(const v1::Scene& scene);

}  // namespace weft::client
