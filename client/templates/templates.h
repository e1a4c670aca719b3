#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "weft/v1/scene.pb.h"

namespace weft::client {

// What a template leaves to choose. Absent: the template's own value.
struct TemplateOptions {
  std::optional<int> rows{};
  std::optional<int> columns{};
  std::optional<double> spacing_m{};     // else the sheet is 1 m wide (cantilever: 32 mm)
  std::optional<v1::Textile> textile{};  // its model alone where it gives no damping
  std::optional<double> bend{};          // paper-*: k_b in the paper's unit, kPaperBend
  std::optional<v1::Evaluator> evaluator{};
  std::optional<int> segments{};  // of LINEARIZED
  bool fold_clamp = false;        // LINEARIZED samples eq. 5
  bool optimal_breakpoints = false;
  std::optional<v1::Accuracy> accuracy{};
};

struct TemplateInfo {
  std::string name;
  std::string description;
};

// The paper gives k_b without a unit: 1 of it is taken as this, N m^2.
inline constexpr double kPaperBend = 1e-4;

std::vector<TemplateInfo> templates();

// Throws Problem: no such template, or an option that it does not have.
v1::Scene make_template(std::string_view name, const TemplateOptions& options = {});

}  // namespace weft::client
