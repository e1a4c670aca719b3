#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/client/client_test.h"

namespace weft::testing {
namespace {

// The scene of a case of data/reference.
v1::Scene reference_scene(const nlohmann::json& given) {
  v1::Scene scene;
  v1::Sheet* sheet = scene.add_sheets();
  const int rows = given["rows"];
  const int columns = given["cols"];
  const double spacing = given["spacing"];
  sheet->mutable_grid()->set_rows(rows);
  sheet->mutable_grid()->set_columns(columns);
  sheet->mutable_grid()->set_spacing_m(spacing);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      for (const double value : {column * spacing, 0.0, row * spacing}) {
        sheet->add_start_positions_m(value);
      }
    }
  }
  v1::RawTextile* raw = sheet->mutable_textile()->mutable_raw();
  raw->set_particle_mass_kg(given["mass"]);
  raw->set_stretch_n_per_m(given["k_stretch"]);
  raw->set_shear_n_per_m(given["k_shear"]);
  raw->set_bend_n_m2(given["k_bend"]);
  raw->set_clamp_n_per_m(given["c_bend"]);
  raw->set_air_drag_kg_per_s(given["air_drag"]);
  sheet->mutable_textile()->set_damping_kg_per_s(given["k_damping"]);
  v1::ChoiKo* law = sheet->mutable_bending()->mutable_choi_ko();
  law->set_evaluator(v1::EVALUATOR_EXACT);
  law->set_diagonal_bend(given["diagonal_bend"]);
  for (const int particle : given["pins"]) {
    if (sheet->pins().empty()) sheet->add_pins();
    sheet->mutable_pins(0)->add_particles(particle);
  }
  v1::Vector3* gravity = scene.mutable_environment()->mutable_gravity_m_per_s2();
  gravity->set_x(given["gravity"][0]);
  gravity->set_y(given["gravity"][1]);
  gravity->set_z(given["gravity"][2]);
  scene.mutable_solver()->set_frame_step_s(0.01);
  scene.mutable_solver()->set_substep_s(2.5e-5);
  return scene;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<double> numbers_of(const std::string& row) {
  std::vector<double> numbers;
  std::istringstream cells(row);
  for (std::string cell; std::getline(cells, cell, ',');) numbers.push_back(std::stod(cell));
  return numbers;
}

// Root of the mean squared distance of the particles; the time comes first in a row.
double rms_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 1; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum * 3 / static_cast<double>(a.size() - 1));
}

class TrajectoryTest : public ClientTest {};

TEST_F(TrajectoryTest, AFlagFollowsTheIndependentSolutionThroughServerRecordingAndExport) {
  const std::string reference = std::string(WEFT_TEST_DATA_DIR) + "/reference/flag_4x7";
  const auto given = nlohmann::json::parse(read_file(reference + ".json"));
  service_.create(reference_scene(given), "flag");
  std::string times;
  for (const double time : given["times"]) {
    times += (times.empty() ? "" : ",") + nlohmann::json(time).dump();
  }

  ask({"record", "flag", "--run", "--to", "50", "--encoding", "float64", "-o", path("flag.weft")});
  ask({"export", path("flag.weft"), "--format", "csv", "--times", times, "-o", path("flag.csv")});

  const auto found = lines_of(read_file(path("flag.csv")));
  const auto wanted = lines_of(read_file(reference + ".csv"));
  ASSERT_EQ(found.size(), wanted.size());
  EXPECT_EQ(found.front(), wanted.front());
  for (std::size_t row = 1; row < wanted.size(); ++row) {
    EXPECT_EQ(found[row].substr(0, found[row].find(',')),
              wanted[row].substr(0, wanted[row].find(',')));
    EXPECT_LT(rms_distance(numbers_of(found[row]), numbers_of(wanted[row])), 1e-7);
  }
}

}  // namespace
}  // namespace weft::testing
