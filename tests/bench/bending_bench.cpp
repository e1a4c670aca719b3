#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/forces/bending_law.h"
#include "tests/bench/lengths.h"

namespace weft {
namespace {

// Time of one g(r), with the largest relative error beside it.
template <class Function>
void evaluate(benchmark::State& state, const Function& function) {
  double largest = 0;
  const ExactBending exact;
  for (const double r : bench::even_lengths())
    largest = std::max(largest, std::abs(function.value(r) / exact.value(r) - 1));
  std::vector<double> g(bench::even_lengths().size());
  for (auto _ : state) {
    std::transform(bench::even_lengths().begin(), bench::even_lengths().end(), g.begin(),
                   [&](double r) { return function.value(r); });
    benchmark::DoNotOptimize(g.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() *
                          static_cast<std::int64_t>(bench::even_lengths().size()));
  if (largest > 0) state.counters["error"] = largest;  // a spread of 0 would be no JSON
}

// Time of one step's bending: of every connection that is shortened.
template <class Function>
void evaluate_hung(benchmark::State& state, const Function& function) {
  const auto& lengths = bench::hung_lengths();
  const std::size_t connections = lengths.size() / bench::kHungSteps;
  std::size_t begin = 0;
  for (auto _ : state) {
    double sum = 0;
    for (std::size_t i = begin; i < begin + connections; ++i)
      if (lengths[i] < 1) sum += function.value(lengths[i]);
    benchmark::DoNotOptimize(sum);
    begin = (begin + connections) % lengths.size();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(connections));
}

// The paper's figure 3: the interval is looked for, from the first on.
class SearchedBending {
 public:
  explicit SearchedBending(int segments) : table_(segments) {
    for (int i = 1; i < segments; ++i) ends_.push_back(static_cast<double>(i) / segments);
  }
  double value(double r) const {
    std::size_t i = 0;
    while (i < ends_.size() && r >= ends_[i]) ++i;
    const auto& segment = table_.segments()[i];
    return segment.intercept + segment.slope * r;
  }

 private:
  LinearizedBending table_;
  std::vector<double> ends_;
};

template <class Function>
void add(const std::string& name, const Function& function) {
  benchmark::RegisterBenchmark(("bending_scalar/" + name).c_str(),
                               [function](benchmark::State& state) { evaluate(state, function); });
  benchmark::RegisterBenchmark(
      ("bending_31x31_scalar/" + name).c_str(),
      [function](benchmark::State& state) { evaluate_hung(state, function); });
}

const bool added = [] {
  add("SERIES", SeriesBending());
  add("EXACT", ExactBending());
  for (const int segments : {2, 5, 16, 32, 60, 256, 1024})
    add("LINEARIZED/" + std::to_string(segments), LinearizedBending(segments));
  for (const int segments : {2, 5, 16, 32, 60})
    add("OPTIMAL/" + std::to_string(segments),
        LinearizedBending(segments, std::nullopt, kOptimalBreakpoints));
  for (const int segments : {5, 32, 60})
    add("SEARCHED/" + std::to_string(segments), SearchedBending(segments));
  for (const int degree : {5, 7, 10})
    add("POLYNOMIAL/" + std::to_string(degree), PolynomialBending(degree));
  for (const int segments : {32, 1024})
    benchmark::RegisterBenchmark(("bending_table/" + std::to_string(segments)).c_str(),
                                 [segments](benchmark::State& state) {
                                   for (auto _ : state)
                                     benchmark::DoNotOptimize(LinearizedBending(segments));
                                 });
  return true;
}();

}  // namespace
}  // namespace weft
