#pragma once

#include <string>
#include <vector>

#include "client/output/json.h"

namespace weft::client {

// A load, or a stage of one.
struct NamedLoad {
  std::string name;
  Json figures;  // as weft load --json has them
};

// One HTML file that asks for nothing: what was asked for, how late frames came of each load, as a
// table and as curves.
std::string load_page(const std::string& asked, const std::vector<NamedLoad>& loads);

}  // namespace weft::client
