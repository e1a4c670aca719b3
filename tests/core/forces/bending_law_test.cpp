#include "core/forces/bending_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/core/reference_case.h"

namespace weft::testing {
namespace {

struct Sample {
  double r, g;
};

// r and g in 25 digits, from data/reference/bending.csv.
const std::vector<Sample>& samples() {
  static const std::vector<Sample> rows = [] {
    std::vector<Sample> out;
    for (const std::vector<double>& row : load_csv("reference/bending.csv"))
      out.push_back({row[0], row[2]});
    return out;
  }();
  return rows;
}

template <class Function>
double largest_error(const Function& function) {
  double largest = 0;
  for (const auto& [r, g] : samples())
    largest = std::max(largest, std::abs(function.value(r) / g - 1));
  return largest;
}

TEST(BendingLaw, ExactAgreesWithThe25DigitValuesEvenCloseToTheFlatSheet) {
  EXPECT_LT(largest_error(ExactBending()), 1e-13);
  EXPECT_EQ(ExactBending().value(1), -12);
  EXPECT_NEAR(ExactBending().value(0), -4 * std::numbers::pi * std::numbers::pi, 1e-12);
}

TEST(BendingLaw, ExactFollowsItsTaylorSeriesNearOne) {
  for (const double s : {1e-3, 1e-5, 1e-8, 1e-12}) {
    const double series = -12 - 36.0 / 5 * s - 864.0 / 175 * s * s - 624.0 / 175 * s * s * s;
    EXPECT_NEAR(ExactBending().value(1 - s) / series, 1, 1e-11) << s;
  }
}

TEST(BendingLaw, LinearSegmentsHaveTheStatedErrors) {
  const std::vector<std::pair<int, double>> stated = {{2, 0.206},    {5, 0.058},    {8, 0.027},
                                                      {16, 0.0084},  {32, 0.0023},  {60, 7e-4},
                                                      {128, 1.6e-4}, {256, 4.0e-5}, {1024, 2.6e-6}};
  for (const auto& [segments, error] : stated) {
    const double found = largest_error(LinearizedBending(segments));
    EXPECT_LT(found, error * 1.06) << segments << " segments";
    EXPECT_GT(found, error * 0.8) << segments << " segments";
  }
}

LinearizedBending optimal(int segments) {
  return LinearizedBending(segments, std::nullopt, kOptimalBreakpoints);
}

TEST(BendingLaw, OptimalBreakpointsHaveTheStatedErrors) {
  const std::vector<std::pair<int, double>> stated = {
      {2, 0.111}, {5, 0.0184}, {16, 1.81e-3}, {32, 4.55e-4}, {60, 1.29e-4}};
  for (const auto& [segments, error] : stated) {
    const double found = largest_error(optimal(segments));
    EXPECT_LT(found, error * 1.01) << segments << " segments";
    EXPECT_GT(found, error * 0.9) << segments << " segments";
  }
}

// How far chords of at most this relative error reach, laid one after the other from r = 0.
double reach(int chords, double error) {
  const ExactBending exact;
  double begin = 0;
  for (int i = 0; i < chords && begin < 1; ++i) {
    const double g = exact.value(begin);
    const auto keeps = [&](double end) {
      const double slope = (exact.value(end) - g) / (end - begin);
      for (double part = 0.02; part < 1; part += 0.02) {
        const double r = begin + part * (end - begin);
        if ((g + slope * (r - begin)) / exact.value(r) - 1 > error) return false;
      }
      return true;
    };
    if (keeps(1)) return 1;
    double inside = begin, outside = 1;
    for (int k = 0; k < 30; ++k) {
      const double middle = (inside + outside) / 2;
      (keeps(middle) ? inside : outside) = middle;
    }
    begin = inside;
  }
  return begin;
}

TEST(BendingLaw, NoBreakpointsAreMoreThanAnEighthBetterThanTheOptimalOnes) {
  for (const int segments : {1, 2, 3, 5, 16, 32})
    EXPECT_LT(reach(segments, largest_error(optimal(segments)) / 1.125), 1) << segments;
  EXPECT_EQ(reach(32, largest_error(optimal(32))), 1);
}

TEST(BendingLaw, ChordsNeverUnderestimateTheForce) {
  for (const auto& [r, g] : samples()) {
    EXPECT_LE(LinearizedBending(5).value(r), g + 1e-9) << r;
    EXPECT_LE(optimal(5).value(r), g + 1e-9) << r;
  }
}

TEST(BendingLaw, APolynomialOfDegreeSixEightAndTenHasTheStatedErrors) {
  EXPECT_LT(largest_error(PolynomialBending(6)), 1.6e-3);
  EXPECT_LT(largest_error(PolynomialBending(8)), 2.3e-4);
  EXPECT_LT(largest_error(PolynomialBending(10)), 3.5e-5);
}

TEST(BendingLaw, TheCorrectedSeriesHasTheStatedErrors) {
  const double exact_at_zero = -4 * std::numbers::pi * std::numbers::pi;
  EXPECT_NEAR(SeriesBending().value(0) / exact_at_zero - 1, -0.0082, 2e-4);
  EXPECT_LT(largest_error(SeriesBending()), 0.0083);
  EXPECT_NEAR(SeriesBending().value(0.5) / ExactBending().value(0.5), 1, 1e-6);
}

// Eq. 6 as it stands in the paper: no prefactor, x = r, and a denominator without its six zeros.
TEST(BendingLaw, TheSeriesAsPrintedDoesNotInvertSinc) {
  const auto printed = [](double x, double last_denominator) {
    const double coefficients[] = {2.0,
                                   3.0 / 10,
                                   321.0 / 2800,
                                   3197.0 / 56000,
                                   445617.0 / 13798400,
                                   1766784699.0 / 89689600000.0,
                                   317184685563.0 / 25113088000000.0,
                                   14328608561991.0 / 1707689984000000.0,
                                   6670995251837391.0 / last_denominator};
    double f = 0, power = x;
    for (const double coefficient : coefficients) f += coefficient * power, power *= x * x;
    return f;
  };
  const auto sinc = [](double u) { return std::sin(u) / u; };
  const double r = 0.5, x = std::sqrt(1 - r), factor = std::sqrt(1.5);
  EXPECT_GT(std::abs(sinc(printed(r, 1165411287040.0)) - r), 0.1);
  EXPECT_GT(std::abs(sinc(factor * printed(x, 1165411287040.0)) - r), 0.1);
  EXPECT_GT(std::abs(sinc(printed(x, 1165411287040000000.0)) - r), 0.1);
  EXPECT_NEAR(sinc(factor * printed(x, 1165411287040000000.0)), r, 2e-5);  // nine terms, corrected
}

template <class Function>
void expect_integral_of_value(const Function& function) {
  for (const double r : {0.05, 0.31, 0.5, 0.77, 0.99}) {
    const double step = 1e-5;
    const double slope = (function.integral(r + step) - function.integral(r - step)) / (2 * step);
    EXPECT_NEAR(slope / function.value(r), 1, 1e-6) << r;
  }
  EXPECT_NEAR(function.integral(1), 0, 1e-12);
}

TEST(BendingLaw, TheIntegralOfEveryEvaluatorHasItsValueAsSlope) {
  expect_integral_of_value(ExactBending());
  expect_integral_of_value(SeriesBending());
  expect_integral_of_value(LinearizedBending(7));
  expect_integral_of_value(optimal(7));
  expect_integral_of_value(PolynomialBending(8));
}

double force(const BendingForce& bending, double length) {
  return std::visit([&](const auto& g) { return bending.force(g, length); }, bending.function());
}

ChoiKo exact() { return {.evaluator = Evaluator::kExact}; }

TEST(BendingLaw, TheForceIsTheLargerOfCurveAndClamp) {
  const double k_b = 3e-4, c_b = 50, rest = 0.1;
  const BendingForce bending(exact(), k_b, c_b, rest);
  for (const auto& [r, g] : samples()) {
    const double expected = std::max(k_b / (rest * rest) * g, c_b * rest * (r - 1));
    EXPECT_NEAR(force(bending, r * rest), expected, 1e-12 * std::abs(expected) + 1e-15) << r;
  }
}

TEST(BendingLaw, BelowItsThresholdTheClampRulesEverywhere) {
  const double rest = 1, c_b = 1;
  EXPECT_TRUE(BendingForce(exact(), c_b / 31.4, c_b, rest).clamp_rules());
  EXPECT_FALSE(BendingForce(exact(), c_b / 31.6, c_b, rest).clamp_rules());
  EXPECT_NEAR(force(BendingForce(exact(), c_b / 20, c_b, rest), 0.4), c_b * (0.4 - 1), 1e-15);
}

TEST(BendingLaw, BetweenItsTwoCrossingsTheCurveRulesAndOutsideTheClamp) {
  const double rest = 1, c_b = 1, k_b = c_b / 35;  // 31.47 < 35 < 39.48
  const BendingForce bending(exact(), k_b, c_b, rest);
  for (const double r : {0.001, 0.05, 0.3, 0.5, 0.7, 0.99})
    EXPECT_NEAR(force(bending, r), std::max(k_b * ExactBending().value(r), c_b * (r - 1)), 1e-14)
        << r;
}

TEST(BendingLaw, TheForceIsTheSlopeOfItsEnergyForEveryEvaluator) {
  std::vector<ChoiKo> laws;
  for (const Evaluator evaluator :
       {Evaluator::kSeries, Evaluator::kExact, Evaluator::kLinearized, Evaluator::kPolynomial})
    laws.push_back({.evaluator = evaluator});
  laws.push_back({.evaluator = Evaluator::kLinearized, .segments = 3, .fold_clamp = true});
  laws.push_back({.segments = 3, .optimal_breakpoints = true});
  for (const ChoiKo& law : laws) {
    for (const double k_b : {1e-4, 1.0 / 35, 1.0}) {
      const BendingForce bending(law, k_b, 1, 1);
      for (const double length : {0.03, 0.2, 0.45, 0.8, 0.97}) {
        const double step = 1e-6;
        const double slope =
            (bending.energy(length + step) - bending.energy(length - step)) / (2 * step);
        EXPECT_NEAR(slope, force(bending, length), 1e-5 * std::abs(force(bending, length)) + 1e-9)
            << "evaluator " << static_cast<int>(law.evaluator) << ", k_b " << k_b << ", l "
            << length;
      }
    }
  }
}

// Figure 7's paper-like sheet: with two segments half of the range is one soft ramp.
TEST(BendingLaw, FoldedTablesEndInARampFromTheLastNodeToZero) {
  const double clamp = 1000;
  const LinearizedBending folded(2, clamp);
  EXPECT_DOUBLE_EQ(folded.value(1), 0);
  EXPECT_NEAR(folded.value(0.5), ExactBending().value(0.5), 1e-12);
  EXPECT_NEAR(folded.value(0.75), ExactBending().value(0.5) / 2, 1e-12);
}

TEST(BendingLaw, NoSlopeIsLargerThanTheStatedBound) {
  for (const double k_b : {1e-4, 0.01, 1.0 / 35, 1.0}) {
    const BendingForce bending(exact(), k_b, 1, 1);
    for (double length = 0.001; length < 1; length += 0.001)
      EXPECT_LE(bending.slope(length), bending.largest_slope() * (1 + 1e-6)) << length;
  }
}

}  // namespace
}  // namespace weft::testing
