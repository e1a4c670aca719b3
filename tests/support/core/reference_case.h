#pragma once

#include <string>
#include <vector>

#include "core/model/scene.h"

namespace weft::testing {

// An independent solution: the scene it belongs to and positions over time.
struct ReferenceCase {
  Scene scene;                                 // EXACT, frame step 0.01 s
  std::vector<double> times;                   // s
  std::vector<std::vector<double>> positions;  // x, y, z of each particle, m
};

// Reads data/reference/NAME.json and NAME.csv.
ReferenceCase load_reference_case(const std::string& name);

// Rows of numbers of a file in data/, without its header.
std::vector<std::vector<double>> load_csv(const std::string& path);

}  // namespace weft::testing
