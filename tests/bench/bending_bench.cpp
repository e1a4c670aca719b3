#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <string>

#include "core/forces/bending_law.h"

namespace weft {
namespace {

// r spread evenly over [0, 1), in no order.
const std::vector<double>& lengths() {
  static const std::vector<double> values = [] {
    std::mt19937_64 random(1);
    std::vector<double> out(4096);
    for (double& r : out) r = static_cast<double>(random() >> 11) * 0x1p-53;
    return out;
  }();
  return values;
}

// Time of one g(r), with the largest relative error beside it.
template <class Function>
void evaluate(benchmark::State& state, const Function& function) {
  double largest = 0;
  const ExactBending exact;
  for (const double r : lengths())
    largest = std::max(largest, std::abs(function.value(r) / exact.value(r) - 1));
  for (auto _ : state) {
    double sum = 0;
    for (const double r : lengths()) sum += function.value(r);
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(lengths().size()));
  state.counters["error"] = largest;
}

template <class Function>
void add(const std::string& name, const Function& function) {
  benchmark::RegisterBenchmark(("bending_scalar/" + name).c_str(),
                               [function](benchmark::State& state) { evaluate(state, function); });
}

const bool added = [] {
  add("SERIES", SeriesBending());
  add("EXACT", ExactBending());
  for (const int segments : {2, 5, 16, 32, 60, 256, 1024})
    add("LINEARIZED/" + std::to_string(segments), LinearizedBending(segments));
  for (const int degree : {5, 7, 10})
    add("POLYNOMIAL/" + std::to_string(degree), PolynomialBending(degree));
  return true;
}();

}  // namespace
}  // namespace weft
