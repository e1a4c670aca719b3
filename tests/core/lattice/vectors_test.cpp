#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <vector>

// compiled again for every target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/core/lattice/vectors_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "core/lattice/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace weft::HWY_NAMESPACE {

// In place; n: whole vectors.
template <class T>
void invert_roots(T* values, std::size_t n) {
  const hn::ScalableTag<T> d;
  for (std::size_t i = 0; i < n; i += hn::Lanes(d))
    hn::StoreU(inverse_sqrt(d, Each<hn::Vec<decltype(d)>, 1>{hn::LoadU(d, values + i)})[0], d,
               values + i);
}
void invert_single_roots(float* values, std::size_t n) { invert_roots(values, n); }
void invert_double_roots(double* values, std::size_t n) { invert_roots(values, n); }

}  // namespace weft::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace weft {

HWY_EXPORT(invert_single_roots);
HWY_EXPORT(invert_double_roots);

namespace testing {
namespace {

void invert(std::vector<float>& values) {
  HWY_DYNAMIC_DISPATCH(invert_single_roots)(values.data(), values.size());
}
void invert(std::vector<double>& values) {
  HWY_DYNAMIC_DISPATCH(invert_double_roots)(values.data(), values.size());
}

struct Errors {
  double largest = 0, mean = 0;
};

// Relative errors between v and 1.01 v, where lengths of like connections lie.
template <class T>
Errors errors_near(double v) {
  constexpr std::size_t kCount = 4096;
  std::vector<T> roots(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    roots[i] = static_cast<T>(v * (1 + 0.01 * static_cast<double>(i) / kCount));
  const std::vector<T> squares = roots;
  invert(roots);
  Errors errors;
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto right = 1 / std::sqrt(static_cast<long double>(squares[i]));
    const auto error = static_cast<double>(roots[i] / right - 1);
    errors.largest = std::max(errors.largest, std::abs(error));
    errors.mean += error / kCount;
  }
  return errors;
}

class InverseSqrts : public ::testing::TestWithParam<std::int64_t> {
 protected:
  InverseSqrts() { hwy::SetSupportedTargetsForTest(GetParam()); }
  ~InverseSqrts() override { hwy::SetSupportedTargetsForTest(0); }
};

constexpr double kLeast = 1e-8, kMost = 4;  // m^2

// Three roundings, of which one counts half, and what the polynomial leaves: that does not cancel,
// so it alone makes every connection of a sheet longer, or shorter.
TEST_P(InverseSqrts, AreRightToTheirRoundingsInSinglePrecision) {
  constexpr double kRounding = 0x1p-24, kPolynomial = 1.2e-8;
  for (double v = kLeast; v < kMost; v *= 1.01) {
    const Errors errors = errors_near<float>(v);
    ASSERT_LE(errors.largest, 2.5 * kRounding + kPolynomial) << v;
    ASSERT_LE(std::abs(errors.mean), 2 * kPolynomial) << v;
  }
}

TEST_P(InverseSqrts, AreRightToTheirRoundingsInDoublePrecision) {
  for (double v = kLeast; v < kMost; v *= 1.01) {
    const Errors errors = errors_near<double>(v);
    ASSERT_LE(errors.largest, 2 * 0x1p-53) << v;
  }
}

std::vector<std::int64_t> targets() {
  std::vector<std::int64_t> found;
  for (const std::int64_t target : {HWY_AVX2, HWY_AVX3, HWY_NEON})
    if ((hwy::SupportedTargets() & target) != 0) found.push_back(target);
  return found;
}

INSTANTIATE_TEST_SUITE_P(Targets, InverseSqrts, ::testing::ValuesIn(targets()),
                         [](const auto& target) { return hwy::TargetName(target.param); });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(InverseSqrts);

}  // namespace
}  // namespace testing
}  // namespace weft
#endif
