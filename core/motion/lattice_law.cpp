#include "core/motion/lattice_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft {
namespace {

template <class T>
BendLaw<T> bend_law(const BendingForce& force, int terms) {
  BendLaw<T> law;
  const double length = force.rest_length(), scale = force.scale();
  law.clamp = static_cast<T>(force.clamp());
  law.clamp_rest = static_cast<T>(force.clamp() * length);
  law.last = static_cast<T>(terms - 1);
  const auto size = static_cast<std::size_t>(std::max(terms, 32));
  law.intercepts = AlignedArray<T>(size);
  law.slopes = AlignedArray<T>(size);
  if (const auto* line = std::get_if<LinearizedBending>(&force.function())) {
    law.to_index = static_cast<T>(terms / length);
    for (std::size_t i = 0; i < line->segments().size(); ++i) {
      law.intercepts.data()[i] = static_cast<T>(scale * line->segments()[i].intercept);
      law.slopes.data()[i] = static_cast<T>(scale / length * line->segments()[i].slope);
    }
  } else {
    law.to_index = static_cast<T>(2 / length);
    const auto& coefficients = std::get<PolynomialBending>(force.function()).coefficients();
    for (std::size_t i = 0; i < coefficients.size(); ++i)
      law.intercepts.data()[i] = static_cast<T>(scale * coefficients[i]);
  }
  return law;
}

template <class T>
BendLaw<T> no_bend(int terms) {
  BendLaw<T> law;
  law.last = static_cast<T>(terms - 1);
  const auto size = static_cast<std::size_t>(std::max(terms, 32));
  law.intercepts = AlignedArray<T>(size);
  law.slopes = AlignedArray<T>(size);
  return law;
}

template <class T>
void set_bending(const SheetDefinition& sheet, const LatticeConstants& k, SweepLaw<T>& law) {
  const double h = sheet.grid.spacing;
  const auto* choi_ko = std::get_if<ChoiKo>(&sheet.bending);
  if (choi_ko == nullptr) {
    const IsometricStiffness stiffness = isometric_stiffness(k, h);
    if (k.rigidity_warp + k.rigidity_weft > 0) law.bend = BendKind::kIsometric;
    law.isometric_warp = static_cast<T>(stiffness.warp);
    law.isometric_weft = static_cast<T>(stiffness.weft);
    law.isometric_twist = static_cast<T>(stiffness.twist);
    return;
  }

  const bool table = choi_ko->evaluator == Evaluator::kLinearized;
  law.terms = table ? choi_ko->segments : choi_ko->degree + 1;
  law.none = no_bend<T>(law.terms);
  bool bends = false;
  const auto make = [&](double bend, double clamp, double length) {
    if (bend == 0 || clamp == 0) return no_bend<T>(law.terms);
    bends = true;
    return bend_law<T>(BendingForce(*choi_ko, bend, clamp, length), law.terms);
  };
  law.along_warp = make(k.bend_warp, k.clamp_warp, 2 * h);
  law.along_weft = make(k.bend_weft, k.clamp_weft, 2 * h);
  law.bend_diagonal = choi_ko->diagonal_bend && k.bend_diagonal > 0 && k.clamp_diagonal > 0;
  if (law.bend_diagonal)
    law.diagonal = make(k.bend_diagonal, k.clamp_diagonal, h * std::hypot(2, 2));
  if (!bends) return;
  law.bend = !table            ? BendKind::kPolynomial
             : law.terms <= 32 ? BendKind::kTable32
                               : BendKind::kTable;
}

}  // namespace

template <class T>
SweepLaw<T> make_sweep_law(const SheetDefinition& sheet) {
  const LatticeConstants k = lattice_constants(sheet);
  const double h = sheet.grid.spacing;
  const auto stretch = [](double stiffness, double length) {
    return StretchLaw<T>{static_cast<T>(stiffness), static_cast<T>(stiffness * length)};
  };
  SweepLaw<T> law;
  law.layout = {sheet.grid.rows, sheet.grid.columns};
  law.warp = stretch(k.stretch_warp, h);
  law.weft = stretch(k.stretch_weft, h);
  law.shear = stretch(k.shear, h * std::numbers::sqrt2);
  law.edge_share = static_cast<T>(k.edge_share);
  set_bending(sheet, k, law);
  if (const auto* choi_ko = std::get_if<ChoiKo>(&sheet.bending)) {
    law.damp_far = true;
    law.damp_far_diagonal = choi_ko->diagonal_bend;
  }

  const int columns = law.layout.columns;
  const auto per_column = [&](const auto& value) {
    AlignedArray<T> out(static_cast<std::size_t>(law.layout.stride() + RowLayout::kLanes));
    for (int c = 0; c < columns; ++c) out.data()[RowLayout::kLanes + c] = static_cast<T>(value(c));
    return out;
  };
  const auto has = [&](int c) { return c >= 0 && c < columns ? 1 : 0; };
  law.column_share = per_column([&](int c) { return has(c - 1) && has(c + 1) ? 1 : k.edge_share; });
  law.near_columns = per_column([&](int c) { return has(c - 1) + 1 + has(c + 1); });
  law.far_columns = per_column([&](int c) { return has(c - 2) + 1 + has(c + 2); });
  return law;
}

template SweepLaw<float> make_sweep_law(const SheetDefinition&);
template SweepLaw<double> make_sweep_law(const SheetDefinition&);

}  // namespace weft
