#include "tests/support/core/reference_case.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace weft::testing {
namespace {

std::ifstream open(const std::string& path) {
  std::ifstream file(std::string(WEFT_TEST_DATA_DIR) + "/" + path);
  if (!file) throw std::runtime_error("cannot read " + path);
  return file;
}

// The lattice squashed along x, with a bump out of its plane, then tilted about x.
std::vector<double> start_positions(const nlohmann::json& data, const Grid& grid) {
  const double h = grid.spacing;
  const double width = (grid.columns - 1) * h, height = (grid.rows - 1) * h;
  const double squash = data.value("squash", 1.0), bump = data.value("bump", 0.0);
  const Eigen::AngleAxisd tilt(-data.value("tilt", 0.0), Vector3d::UnitX());
  std::vector<double> out;
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      const double x = c * h * squash, z = r * h;
      const double y =
          bump * std::sin(std::numbers::pi * x / width) * std::cos(std::numbers::pi * z / height);
      const Vector3d position = tilt * Vector3d(x, y, z);
      out.insert(out.end(), position.begin(), position.end());
    }
  }
  return out;
}

}  // namespace

std::vector<std::vector<double>> load_csv(const std::string& path) {
  std::ifstream file = open(path);
  std::string line;
  std::getline(file, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::vector<double>& row = rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) row.push_back(std::stod(field));
  }
  return rows;
}

ReferenceCase load_reference_case(const std::string& name) {
  const auto data = nlohmann::json::parse(open("reference/" + name + ".json"));
  SheetDefinition sheet;
  sheet.name = "sheet";
  const Grid grid{data["rows"], data["cols"], data["spacing"]};
  sheet.shape = grid;
  sheet.textile.model = RawTextile{.particle_mass = data["mass"],
                                   .stretch = data["k_stretch"],
                                   .shear = data["k_shear"],
                                   .bend = data["k_bend"],
                                   .clamp = data["c_bend"].get<double>(),
                                   .air_drag = data["air_drag"]};
  sheet.textile.damping = data["k_damping"];
  sheet.bending = ChoiKo{.evaluator = Evaluator::kExact, .diagonal_bend = data["diagonal_bend"]};
  sheet.start_positions = start_positions(data, grid);
  const auto pinned = data["pins"].get<std::vector<int>>();
  if (!pinned.empty()) sheet.pins.push_back({pinned, {}});

  ReferenceCase reference;
  const auto gravity = data["gravity"].get<std::vector<double>>();
  reference.scene.environment.gravity = Vector3d(gravity.data());
  reference.scene.solver.frame_step = 0.01;
  reference.scene.sheets = {sheet};
  for (std::vector<double>& row : load_csv("reference/" + name + ".csv")) {
    reference.times.push_back(row.front());
    row.erase(row.begin());
    reference.positions.push_back(std::move(row));
  }
  return reference;
}

}  // namespace weft::testing
