#include "core/model/scene.h"

#include <algorithm>

namespace weft {

Vector3d offset_at(const Path& path, double time) {
  if (path.empty()) return Vector3d::Zero();
  const auto next = std::upper_bound(path.begin(), path.end(), time,
                                     [](double t, const Keyframe& key) { return t < key.time; });
  if (next == path.begin()) return path.front().offset;
  if (next == path.end()) return path.back().offset;
  const Keyframe& before = *(next - 1);
  const double share = (time - before.time) / (next->time - before.time);
  return before.offset + share * (next->offset - before.offset);
}

SolverSettings default_settings(Accuracy accuracy) {
  SolverSettings settings;
  if (accuracy == Accuracy::kDraft) {
    settings.max_self_weight_strain = 0.01;
    settings.step_bound = StepBound::kUnsheared;
    settings.integrator = IntegratorKind::kLaggedVerlet;
  }
  if (accuracy == Accuracy::kFine) {
    settings.precision = Precision::kDouble;
    settings.safety /= 4;
  } else {
    settings.slow_forces_every = 4;
  }
  return settings;
}

BendingLaw default_bending(Accuracy accuracy) {
  if (accuracy != Accuracy::kFine) return ChoiKo{};
  return ChoiKo{.evaluator = Evaluator::kPolynomial, .degree = 12};
}

double end_of_untangling(const Scene& scene) {
  constexpr double kAfterDressing = 3;  // s
  if (!scene.cloth_contact) return 0;
  if (scene.untangle) return *scene.untangle;
  return scene.dressing ? scene.dressing->end() + kAfterDressing : 0;
}

double most_thickness(const SheetDefinition& sheet) { return shortest_edge(sheet.shape) / 4; }

double SheetDefinition::skin_or_default() const {
  return skin.value_or(weft::spacing(shown(shape)) / 10);
}

double SheetDefinition::thickness_or_default() const {
  constexpr double kUsual = 2e-3;
  return thickness.value_or(std::min(kUsual, most_thickness(*this)));
}

}  // namespace weft
