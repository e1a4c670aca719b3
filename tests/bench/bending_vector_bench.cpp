#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "core/forces/bending_law.h"
#include "tests/bench/lengths.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/bending_vector_bench.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/lattice/vectors-inl.h"
#include "hwy/contrib/math/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

// Four vectors at a time; n: a multiple of 64.
template <class F>
HWY_INLINE void map(const float* r, float* HWY_RESTRICT g, std::size_t n, const F& f) {
  const D d;
  const std::size_t step = hn::Lanes(d);
  for (std::size_t i = 0; i < n; i += 4 * step) {
    const auto at = [&](std::size_t k) HWY_ATTR { return hn::Load(d, r + i + k * step); };
    const auto values = each(f, Each<V, 4>{at(0), at(1), at(2), at(3)});
    hn::Store(values[0], d, g + i);
    hn::Store(values[1], d, g + i + step);
    hn::Store(values[2], d, g + i + 2 * step);
    hn::Store(values[3], d, g + i + 3 * step);
  }
}

// The kernels' own lookups: slope and intercept change places, for they give f / l.
template <BendKind kKind>
void segments(const BendLaw<float>& law, int, const float* r, float* g, std::size_t n) {
  const D d;
  map(r, g, n, [&](V v) HWY_ATTR { return line<kKind>(d, law, place<kKind>(d, law, v), v); });
}
void chebyshev(const BendLaw<float>& law, int terms, const float* r, float* g, std::size_t n) {
  const D d;
  map(r, g, n, [&](V v) HWY_ATTR {
    return polynomial(d, law, terms, place<BendKind::kPolynomial>(d, law, v));
  });
}
// Eq. 6 in vectors, Horner in 1 - r; law.intercepts: the series' coefficients, highest first.
void series(const BendLaw<float>& law, int terms, const float* r, float* g, std::size_t n) {
  const D d;
  map(r, g, n, [&](V v) HWY_ATTR {
    const V x2 = hn::Sub(hn::Set(d, 1.0f), v);
    V f = hn::Zero(d);
    for (int k = 0; k < terms; ++k) f = hn::MulAdd(f, x2, hn::Set(d, law.intercepts.data()[k]));
    const V u = hn::Mul(hn::Sqrt(hn::Mul(hn::Set(d, 1.5f), x2)), f);
    return hn::Div(hn::Mul(hn::Set(d, 4.0f), hn::Mul(u, u)), hn::Sub(hn::Cos(d, u), v));
  });
}
void segments32(const BendLaw<float>& law, int terms, const float* r, float* g, std::size_t n) {
  segments<BendKind::kTable32>(law, terms, r, g, n);
}
void optimal32(const BendLaw<float>& law, int terms, const float* r, float* g, std::size_t n) {
  segments<BendKind::kOptimalTable32>(law, terms, r, g, n);
}
void segments_more(const BendLaw<float>& law, int terms, const float* r, float* g, std::size_t n) {
  segments<BendKind::kTable>(law, terms, r, g, n);
}

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(segments32);
HWY_EXPORT(optimal32);
HWY_EXPORT(segments_more);
HWY_EXPORT(chebyshev);
HWY_EXPORT(series);

namespace {

using Function = void (*)(const BendLaw<float>&, int, const float*, float*, std::size_t);

// Time of one g(r) in vectors, with the largest relative error beside it; r up to 1 - 1e-3: nearer
// the flat sheet the series is 0 / 0 in single precision.
template <class Dispatch>
void evaluate(benchmark::State& state, const Dispatch& dispatch, const BendLaw<float>& law,
              int terms) {
  const std::size_t count = bench::even_lengths().size();
  AlignedArray<float> r(count), g(count);
  for (std::size_t i = 0; i < count; ++i)
    r.data()[i] = 0.999f * static_cast<float>(bench::even_lengths()[i]);
  const auto run = [&] { dispatch()(law, terms, r.data(), g.data(), count); };
  run();  // picks the target
  for (auto _ : state) {
    run();
    benchmark::ClobberMemory();
  }
  double largest = 0;
  const ExactBending exact;
  for (std::size_t i = 0; i < count; ++i) {
    const double true_value = exact.value(double{r.data()[i]});
    largest = std::max(largest, std::abs(double{g.data()[i]} / true_value - 1));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
  state.counters["error"] = largest;
}

// Time of one step's bending: of every connection, shortened or not.
template <class Dispatch>
void evaluate_hung(benchmark::State& state, const Dispatch& dispatch, const BendLaw<float>& law,
                   int terms) {
  const auto& lengths = bench::hung_lengths();
  const std::size_t connections = lengths.size() / bench::kHungSteps;
  const std::size_t padded = (connections + 63) / 64 * 64;
  AlignedArray<float> r(padded * bench::kHungSteps), g(padded);
  for (std::size_t i = 0; i < lengths.size(); ++i)
    r.data()[i / connections * padded + i % connections] = static_cast<float>(lengths[i]);
  std::size_t step = 0;
  for (auto _ : state) {
    dispatch()(law, terms, r.data() + step * padded, g.data(), padded);
    benchmark::ClobberMemory();
    step = (step + 1) % bench::kHungSteps;
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(connections));
}

template <class Dispatch>
void add(const std::string& name, const Dispatch& dispatch, const std::vector<double>& intercepts,
         const std::vector<double>& slopes, const std::array<float, 4>& to_index) {
  const auto with_law = [=](const auto& run) {
    BendLaw<float> law;
    const auto fill = [](const std::vector<double>& from, AlignedArray<float>& to) {
      to = AlignedArray<float>(std::max<std::size_t>(32, from.size()));
      std::transform(from.begin(), from.end(), to.data(),
                     [](double value) { return static_cast<float>(value); });
    };
    fill(intercepts, law.intercepts);
    fill(slopes, law.slopes);
    law.to_index = to_index;
    law.last = static_cast<float>(intercepts.size() - 1);
    law.half_segment = 0.5f / static_cast<float>(intercepts.size());
    run(law, static_cast<int>(intercepts.size()));
  };
  benchmark::RegisterBenchmark(("bending/" + name).c_str(), [=](benchmark::State& state) {
    with_law([&](const BendLaw<float>& law, int terms) { evaluate(state, dispatch, law, terms); });
  });
  benchmark::RegisterBenchmark(("bending_31x31/" + name).c_str(), [=](benchmark::State& state) {
    with_law(
        [&](const BendLaw<float>& law, int terms) { evaluate_hung(state, dispatch, law, terms); });
  });
}

const bool added = [] {
  const auto add_table = [](const std::string& name, int n, const Breakpoints& breakpoints,
                            Function (*registers)()) {
    std::vector<double> intercepts, slopes;
    const LinearizedBending linearized(n, std::nullopt, breakpoints);
    for (const auto& segment : linearized.segments()) {
      intercepts.push_back(segment.intercept);
      slopes.push_back(segment.slope);
    }
    std::array<float, 4> to_index{};
    for (std::size_t k = 0; k < to_index.size(); ++k)
      to_index[k] = static_cast<float>(n * breakpoints[k]);
    add(
        name + std::to_string(n),
        [n, registers]() -> Function {
          return n <= 32 ? registers() : HWY_DYNAMIC_DISPATCH(segments_more);
        },
        slopes, intercepts, to_index);
  };
  for (const int n : {2, 5, 16, 32, 60, 256, 1024})
    add_table("LINEARIZED/", n, kEqualBreakpoints,
              []() -> Function { return HWY_DYNAMIC_DISPATCH(segments32); });
  for (const int n : {2, 5, 16, 32, 60})
    add_table("OPTIMAL/", n, kOptimalBreakpoints,
              []() -> Function { return HWY_DYNAMIC_DISPATCH(optimal32); });
  for (const int degree : {5, 7, 10})
    add("POLYNOMIAL/" + std::to_string(degree),
        []() -> Function { return HWY_DYNAMIC_DISPATCH(chebyshev); },
        PolynomialBending(degree).coefficients(), {}, {2});
  const auto& terms = SeriesBending::kCoefficients;
  add("SERIES", []() -> Function { return HWY_DYNAMIC_DISPATCH(series); },
      {terms.begin(), terms.end()}, {}, {});
  return true;
}();

}  // namespace
}  // namespace weft
#endif
