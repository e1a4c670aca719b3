#include "core/lattice/law.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

namespace weft {
namespace {

// k and k L of a spring (N/m, N), rounded so that their ratio is L to some 1e-9: each to the
// nearest, they would make all connections longer, or shorter, by the same. k gives way by up to
// 1e-6.
template <class T>
std::pair<T, T> rounded(double stiffness, double length) {
  constexpr int kTries = 16;
  auto k = static_cast<T>(stiffness);
  std::pair<T, T> best{k, static_cast<T>(k * length)};
  const auto error = [&](const std::pair<T, T>& each) {
    return std::abs(double{each.second} / each.first - length);
  };
  for (int i = 1; stiffness > 0 && i < kTries; ++i) {
    k = std::nextafter(k, std::numeric_limits<T>::max());
    const std::pair<T, T> next{k, static_cast<T>(k * length)};
    if (error(next) < error(best)) best = next;
  }
  return best;
}

template <class T>
BendLaw<T> bend_law(const BendingForce& force, int terms, double share) {
  BendLaw<T> law;
  const double length = force.rest_length(), scale = share * force.scale();
  std::tie(law.clamp, law.clamp_rest) = rounded<T>(share * force.clamp(), length);
  law.last = static_cast<T>(terms - 1);
  const auto size = static_cast<std::size_t>(std::max(terms, 32));
  law.intercepts = AlignedArray<T>(size);
  law.slopes = AlignedArray<T>(size);
  if (const auto* line = std::get_if<LinearizedBending>(&force.function())) {
    double to_index = terms;
    for (std::size_t k = 0; k < law.to_index.size(); ++k)
      law.to_index[k] = static_cast<T>((to_index /= length) * line->breakpoints()[k]);
    law.half_segment = static_cast<T>(length / (2 * terms));
    for (std::size_t i = 0; i < line->segments().size(); ++i) {
      law.intercepts.data()[i] = static_cast<T>(scale * line->segments()[i].intercept);
      law.slopes.data()[i] = static_cast<T>(scale / length * line->segments()[i].slope);
    }
  } else {
    law.to_index[0] = static_cast<T>(2 / length);
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
  const double h = sheet.spacing();
  const auto* choi_ko = std::get_if<ChoiKo>(&sheet.bending);
  if (choi_ko == nullptr) {
    const IsometricStiffness stiffness = isometric_stiffness(k, h);
    if (k.rigidity_warp + k.rigidity_weft > 0) law.bend = BendKind::kIsometric;
    law.isometric_warp = static_cast<T>(stiffness.warp);
    law.isometric_warp_edge = static_cast<T>(k.edge_share * stiffness.warp);
    law.isometric_weft = static_cast<T>(stiffness.weft);
    law.isometric_twist = static_cast<T>(stiffness.twist);
    return;
  }

  const bool table = choi_ko->evaluator == Evaluator::kLinearized;
  law.terms = table ? choi_ko->segments : choi_ko->degree + 1;
  law.none = no_bend<T>(law.terms);
  bool bends = false;
  const auto make = [&](double bend, double clamp, double length, double share = 1) {
    if (bend == 0 || clamp == 0) return no_bend<T>(law.terms);
    bends = true;
    return bend_law<T>(BendingForce(*choi_ko, bend, clamp, length), law.terms, share);
  };
  law.along_warp = make(k.bend_warp, k.clamp_warp, 2 * h);
  law.along_warp_edge = make(k.bend_warp, k.clamp_warp, 2 * h, k.edge_share);
  law.along_weft = make(k.bend_weft, k.clamp_weft, 2 * h);
  law.bend_diagonal = choi_ko->diagonal_bend && k.bend_diagonal > 0 && k.clamp_diagonal > 0;
  if (law.bend_diagonal)
    law.diagonal = make(k.bend_diagonal, k.clamp_diagonal, h * std::hypot(2, 2));
  if (!bends) return;
  law.bend = !table                         ? BendKind::kPolynomial
             : law.terms > 32               ? BendKind::kTable
             : choi_ko->optimal_breakpoints ? BendKind::kOptimalTable32
                                            : BendKind::kTable32;
}

template <class T>
void set_columns(double edge_share, SweepLaw<T>& law) {
  constexpr int kLanes = LatticeLayout<T>::kLanes;
  const LatticeLayout<T>& layout = law.layout;
  const int n = layout.vectors();
  const auto has = [&](int c) { return c >= 0 && c < layout.columns; };
  const auto bits = [](bool on) {
    T value = 0;
    if (on) std::memset(&value, 0xff, sizeof value);
    return value;
  };

  law.columns = AlignedArray<T>(static_cast<std::size_t>(n * kColumnPlanes * kLanes));
  law.border.resize(static_cast<std::size_t>(n));
  for (int j = 0; j < n; ++j) {
    char& border = law.border[static_cast<std::size_t>(j)];
    for (int lane = 0; lane < kLanes; ++lane) {
      const int c = layout.column(j, lane);
      T* const at = law.columns.data() + j * kColumnPlanes * kLanes + lane;
      at[kShare * kLanes] = static_cast<T>(has(c - 1) && has(c + 1) ? 1 : edge_share);
      at[kNearCount * kLanes] = static_cast<T>(has(c - 1) + has(c) + has(c + 1));
      at[kFarCount * kLanes] = static_cast<T>(has(c - 2) + has(c) + has(c + 2));
      at[kRight1 * kLanes] = bits(has(c) && has(c + 1));
      at[kRight2 * kLanes] = bits(has(c) && has(c + 2));
      at[kLeft1 * kLanes] = bits(has(c) && has(c - 1));
      at[kLeft2 * kLanes] = bits(has(c) && has(c - 2));
      for (const int neighbour : {c - 2, c - 1, c + 1, c + 2})
        if (has(neighbour) != has(c)) border = 1;
    }
  }

  law.halo_exists = AlignedArray<T>(2 * layout.kHalo * kLanes);
  law.halo_folds = AlignedArray<T>(2 * layout.kHalo * kLanes);
  law.halo_from = AlignedArray<LaneNumber<T>>(2 * layout.kHalo * kLanes);
  law.halo_to = AlignedArray<LaneNumber<T>>(2 * layout.kHalo * kLanes);
  for (int k = 0; k < 2 * layout.kHalo; ++k) {
    for (int lane = 0; lane < kLanes; ++lane) {
      law.halo_exists.data()[k * kLanes + lane] = bits(has(layout.column(layout.halo(k), lane)));
      const int from = lane - layout.halo_shift(k);
      law.halo_folds.data()[k * kLanes + lane] = bits(from >= 0 && from < kLanes);
      law.halo_from.data()[k * kLanes + lane] = (lane + layout.halo_shift(k)) & (kLanes - 1);
      law.halo_to.data()[k * kLanes + lane] = from & (kLanes - 1);
    }
  }
}

}  // namespace

template <class T>
SweepLaw<T> make_sweep_law(const SheetDefinition& sheet) {
  const LatticeConstants k = lattice_constants(sheet);
  const double h = sheet.spacing();
  const T least = resists_compression(sheet.bending) ? std::numeric_limits<T>::lowest() : T(0);
  const auto stretch = [](double stiffness, double length, T lowest) {
    const auto [least_off, rest] = rounded<T>(stiffness, length);
    return StretchLaw<T>{least_off, rest, lowest};
  };
  SweepLaw<T> law;
  law.layout = {grid_of(sheet).rows, grid_of(sheet).columns};
  law.warp = stretch(k.stretch_warp, h, least);
  law.warp_edge = stretch(k.edge_share * k.stretch_warp, h, least);
  law.weft = stretch(k.stretch_weft, h, least);
  law.shear = stretch(k.shear, h * std::numbers::sqrt2, 0);
  set_bending(sheet, k, law);
  if (const auto* choi_ko = std::get_if<ChoiKo>(&sheet.bending)) {
    law.damp_far = true;
    law.damp_far_diagonal = choi_ko->diagonal_bend;
  }

  set_columns(k.edge_share, law);
  return law;
}

template SweepLaw<float> make_sweep_law(const SheetDefinition&);
template SweepLaw<double> make_sweep_law(const SheetDefinition&);

}  // namespace weft
