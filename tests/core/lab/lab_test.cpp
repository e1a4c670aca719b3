#include "core/lab/lab.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "core/lab/drape.h"
#include "core/lab/elastica.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Tropical wool: B = 5.56 uN m along the warp, so that 41.5 degrees take an overhang of 30 mm.
MeasuredTextile wool() {
  return {.areal_density = 0.168,
          .tensile_warp = 2133,
          .tensile_weft = 1671,
          .shear = 26.17,
          .bend_rigidity_warp = 5.56e-6,
          .bend_rigidity_weft = 5.02e-6,
          .air_drag = 0};
}

LabReport run(LabTest test, const BendingLaw& bending, const std::vector<double>& spacings,
              const MeasuredTextile& textile = wool(), bool weft = false) {
  const LabOrder order{test, textile, bending, weft, spacings};
  EXPECT_THAT(find_problems(order), IsEmpty());
  return run_lab(order);
}

double relative_error(const LabValue& value) { return value.found / value.asked.value() - 1; }

TEST(HeavyElastica, FollowsAnIndependentSolution) {
  std::ifstream file(WEFT_TEST_DATA_DIR "/reference/cantilever.csv");
  std::string line;
  std::getline(file, line);
  int cases = 0;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream row(line);
    double q = 0, x = 0, drop = 0;
    row >> q >> x >> drop;
    if (q > 100) break;  // a boundary layer at the clamp: no cloth is tested there
    const Eigen::Vector2d tip = heavy_elastica(q, 11).col(10);
    EXPECT_NEAR(tip.x(), x, 1e-7) << q;
    EXPECT_NEAR(tip.y(), drop, 1e-7) << q;
    ++cases;
  }
  EXPECT_EQ(cases, 11);
}

TEST(HeavyElastica, HangsAt41AndAHalfDegreesAsTheStandardSays) {
  const Eigen::Vector2d tip = heavy_elastica(kCantileverQ, 11).col(10);
  EXPECT_NEAR(chord_angle(tip.x(), tip.y()), 41.5, 0.05);
}

std::vector<LabValue> named(const LabReport& report, const std::string& quantity) {
  std::vector<LabValue> values;
  for (const LabValue& value : report.values)
    if (value.quantity == quantity) values.push_back(value);
  return values;
}

TEST(Lab, AnIsometricCantileverHangsWithinHalfADegreeOfTheStandardFrom1To8Millimetres) {
  const LabReport report = run(LabTest::kCantilever, Isometric{}, {0.001, 0.002, 0.004, 0.007});
  ASSERT_EQ(report.values.size(), 4u);
  for (const LabValue& value : report.values) EXPECT_NEAR(value.found, 41.5, 0.5) << value.spacing;
  EXPECT_LT(report.values.front().spacing, 0.0011);
  EXPECT_GT(report.values.back().spacing, 0.0065);
  EXPECT_THAT(report.notes, IsEmpty());
}

// Bending shortens a strip near its clamp, where its weight does not pull.
TEST(Lab, AnIsometricCantileverThatIsShortenedAtNoCostHangsLower) {
  const Isometric shortened{.resist_compression = false};
  EXPECT_NEAR(run(LabTest::kCantilever, shortened, {0.002}).values[0].found, 41.5 + 0.75, 0.1);
}

TEST(Lab, AnIsometricCantileverConvergesToSecondOrder) {
  const auto values = run(LabTest::kCantilever, Isometric{}, {0.0067, 0.0040, 0.0021}).values;
  ASSERT_EQ(values.size(), 3u);
  for (std::size_t k = 1; k < 3; ++k) {
    const double finer = values[k - 1].spacing / values[k].spacing;
    EXPECT_GT(relative_error(values[k - 1]) / relative_error(values[k]), 0.8 * finer * finer);
  }
}

TEST(Lab, InterlacedConnectionsHangTooLimpOnAFineMeshAndTheReportSaysSo) {
  const LabReport report = run(LabTest::kCantilever, ChoiKo{}, {0.006, 0.0025});
  EXPECT_GT(report.values[1].found, report.values[0].found + 3);
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("ISOMETRIC")));
}

TEST(Lab, AStripThatMayNarrowMeasuresItsTensileStiffness) {
  for (const bool weft : {false, true}) {
    const Isometric shortened{.resist_compression = false};
    const LabReport report = run(LabTest::kTensile, shortened, {0.0125}, wool(), weft);
    EXPECT_EQ(report.values[0].quantity, "modulus, free width");
    EXPECT_EQ(report.values[0].asked, weft ? 1671 : 2133);
    // near its clamps the width is held, where it is stiffer by 2 G / E = 2.5 %
    EXPECT_NEAR(relative_error(report.values[0]), 0, 0.015);
  }
}

// Shear connections narrow the strip until what crosses it resists: the least of
// E e^2 + E' e'^2 + 2 G (e + e')^2 over e' is (E + 2 G E' / (E' + 2 G)) e^2.
TEST(Lab, AStripWhoseThreadsResistCompressionMeasuresShearAsTheyLetIt) {
  for (const bool weft : {false, true}) {
    const double along = weft ? 1671 : 2133, across = weft ? 2133 : 1671, shear = 2 * wool().shear;
    const double found =
        run(LabTest::kTensile, Isometric{}, {0.0125}, wool(), weft).values[0].found;
    EXPECT_NEAR(found / (along + shear * across / (across + shear)), 1, 0.001);
  }
}

TEST(Lab, AStripOfHeldWidthMeasuresTheShearConnectionsToo) {
  MeasuredTextile knit = wool();
  knit.shear = 500;
  const LabReport report = run(LabTest::kTensile, Isometric{}, {0.025, 0.0125}, knit);
  for (const LabValue& value : named(report, "modulus, clamped width"))
    EXPECT_NEAR(value.found, knit.tensile_warp + 2 * knit.shear, 0.01 * value.asked.value())
        << "E + 2 G, up to the strain of 1 %";
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("E + 2 G")));
}

TEST(Lab, AShearedFrameMeasuresItsShearStiffnessAtEveryResolution) {
  for (const BendingLaw& law :
       {BendingLaw(Isometric{}), BendingLaw(ChoiKo{.diagonal_bend = false})})
    for (const LabValue& value : run(LabTest::kShear, law, {}).values)
      EXPECT_NEAR(relative_error(value), 0, 0.02) << "of the order of the angle";
}

// The diagonal that shear shortens is a bend connection too.
TEST(Lab, DiagonalBendConnectionsStiffenShearAndTheReportSaysSo) {
  const LabReport report = run(LabTest::kShear, ChoiKo{}, {0.02, 0.005});
  EXPECT_LT(relative_error(report.values[0]), 0.05) << "20 mm";
  EXPECT_GT(relative_error(report.values[1]), 0.3) << "5 mm";
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("diagonal")));
}

TEST(Lab, AChainHangsAsACatenaryToSecondOrder) {
  const LabReport report = run(LabTest::kChain, Isometric{}, {0.05, 0.025, 0.0125});
  ASSERT_EQ(report.values.size(), 3u);
  for (std::size_t k = 1; k < 3; ++k)
    EXPECT_NEAR(relative_error(report.values[k - 1]) / relative_error(report.values[k]), 4, 1);
  EXPECT_LT(std::abs(relative_error(report.values[2])), 2e-3);
}

TEST(Lab, TheBendingCurveIsAsFarOffAsItsSegmentsMakeIt) {
  const LabReport report =
      run(LabTest::kBending, ChoiKo{.segments = 16, .diagonal_bend = false}, {0.03});
  ASSERT_EQ(report.curves.size(), 1u);
  EXPECT_THAT(report.curves[0].columns,
              ElementsAre("r", "f_b N", "f_b* N", "approximation N", "error N"));
  double largest = 0;
  for (const auto& row : report.curves[0].rows)
    if (row[2] == row[1]) largest = std::max(largest, std::abs(row[4] / row[2]));
  EXPECT_NEAR(largest, 0.0084, 0.0008) << "16 segments: 0.84 %";
  // g(0) = -4 pi^2, k_b = 2/3 B h, L = 2 h
  EXPECT_NEAR(report.curves[0].rows[0][1], -39.478 * 2 / 3 * 5.56e-6 * 0.03 / (0.06 * 0.06), 1e-6);
}

TEST(Lab, OrdersThatCannotBeRunAreRefusedWithFieldValueAndBound) {
  const auto problems = [](const LabOrder& order) { return find_problems(order); };
  LabOrder order{LabTest::kCantilever, wool(), Isometric{}, false, {0.2, 1e-6}};
  EXPECT_THAT(problems(order), ElementsAre(Field(&Problem::field, "spacings_m[0]"),
                                           Field(&Problem::field, "spacings_m[1]")));
  order.spacings.clear();
  order.textile.bend_rigidity_warp = 0;
  EXPECT_THAT(problems(order),
              ElementsAre(Field(&Problem::field, "textile.measured.bend_rigidity_warp_n_m")));
  order.weft = true;
  EXPECT_THAT(problems(order), IsEmpty());
  order.test = LabTest::kBending;
  EXPECT_THAT(problems(order), ElementsAre(Field(&Problem::field, "bending")));
  order = {LabTest::kTensile, wool(), Isometric{}, false, {1e-4}};
  EXPECT_THAT(problems(order), ElementsAre(Field(&Problem::message, HasSubstr("particles"))));
}

// Deflection at radius r of a plate of rigidity B (Poisson's ratio 0) and weight q per area,
// clamped at radius a and free at b: q r^4 / (64 B) + c0 + c1 r^2 + c2 ln r + c3 r^2 ln r
// (Timoshenko).
class AnnularPlate {
 public:
  AnnularPlate(double rigidity, double q, double a, double b) : k_(q / (64 * rigidity)) {
    Eigen::Matrix4d matrix;
    matrix.row(0) = terms(a);                                     // w = 0
    matrix.row(1) << 0, 2 * a, 1 / a, a * (2 * std::log(a) + 1);  // w' = 0
    matrix.row(2) << 0, 2, -1 / (b * b), 2 * std::log(b) + 3;     // no moment: w'' = 0
    matrix.row(3) << 0, 0, 0, 4 / b;                              // no shear: (w'' + w' / r)' = 0
    const Eigen::Vector4d load(std::pow(a, 4), 4 * std::pow(a, 3), 12 * b * b, 32 * b);
    c_ = matrix.partialPivLu().solve(-k_ * load);
  }
  double deflection(double r) const { return k_ * std::pow(r, 4) + terms(r).dot(c_); }

 private:
  static Eigen::RowVector4d terms(double r) { return {1, r * r, std::log(r), r * r * std::log(r)}; }
  double k_;
  Eigen::Vector4d c_;
};

TEST(Lab, AStiffDiscBendsAsAnAnnularPlateDoes) {
  constexpr double kRigidity = 0.1, kRadius = 0.15, kHeld = 0.09, kSpacing = 0.0075;
  MeasuredTextile board = wool();
  board.bend_rigidity_warp = board.bend_rigidity_weft = kRigidity;
  const Specimen disc = cut_disc(board, Isometric{}, kRadius, kHeld, kSpacing);
  const Equilibrium rest =
      find_equilibrium(disc.mesh, disc.held, {0, -kStandardGravity, 0}, disc.start, 1e-8);
  ASSERT_TRUE(rest.found);
  const AnnularPlate plate(kRigidity, board.areal_density * kStandardGravity, kHeld, kRadius);
  double found = 0, asked = 0;
  for (Eigen::Index i = 0; i < rest.x.cols(); ++i) {
    if (disc.held[i] != 0) continue;
    found -= rest.x(1, i);
    asked += plate.deflection(std::hypot(disc.start(0, i), disc.start(2, i)));
  }
  EXPECT_NEAR(found / asked, 1, 0.05);
}

TEST(Lab, ADiscIsRefinedUntilTheNextSpacingChangesItsShadowByLessThanTwoPoints) {
  MeasuredTextile board = wool();
  board.bend_rigidity_warp = board.bend_rigidity_weft = 0.1;
  const auto coefficients = [](const LabReport& report) {
    std::vector<double> found;
    for (const LabValue& value : named(report, "drape coefficient")) found.push_back(value.found);
    return found;
  };
  EXPECT_EQ(coefficients(run(LabTest::kDrape, Isometric{}, {}, board)).size(), 2);
  const LabReport report = run(LabTest::kDrape, Isometric{}, {}, wool());
  const std::vector<double> found = coefficients(report);
  ASSERT_GT(found.size(), 2);
  for (std::size_t k = 1; k < found.size(); ++k)
    EXPECT_EQ(std::abs(found[k] - found[k - 1]) < 2, k + 1 == found.size());
  const auto says_so = [](const std::string& note) {
    return note.find("less than 2 points: the last one by ") != std::string::npos;
  };
  EXPECT_EQ(std::count_if(report.notes.begin(), report.notes.end(), says_so), 1);
}

TEST(Lab, StifferTextilesThrowALargerShadow) {
  double before = 0;
  for (const double factor : {1.0, 10.0, 1000.0}) {
    MeasuredTextile textile = wool();
    textile.bend_rigidity_warp *= factor;
    textile.bend_rigidity_weft *= factor;
    const LabReport report = run(LabTest::kDrape, Isometric{}, {0.02}, textile);
    ASSERT_EQ(report.values.front().quantity, "drape coefficient");
    EXPECT_FALSE(report.values.front().asked);
    EXPECT_GT(report.values.front().found, before);
    before = report.values.front().found;
    if (factor == 1) {
      EXPECT_GE(named(report, "folds").front().found, 3);
    }
  }
  EXPECT_NEAR(before, 100, 0.1);  // a board
}

class LabOnTriangles : public ::testing::TestWithParam<Cut> {
 protected:
  static LabReport run(LabTest test, const std::vector<double>& spacings, bool weft = false,
                       const MeasuredTextile& textile = wool()) {
    const LabOrder order{test, textile, Isometric{}, weft, spacings, GetParam()};
    EXPECT_THAT(find_problems(order), IsEmpty());
    return run_lab(order);
  }
};
INSTANTIATE_TEST_SUITE_P(, LabOnTriangles,
                         ::testing::Values(Cut::kRight, Cut::kAlternating, Cut::kEquilateral,
                                           Cut::kIrregular));

TEST_P(LabOnTriangles, StripsAndFramesMeasureTheirStiffnessWithinOnePercent) {
  for (const bool weft : {false, true})
    for (const LabTest test : {LabTest::kTensile, LabTest::kShear}) {
      const LabReport report = run(test, {0.0125, 0.007}, weft);
      EXPECT_GE(report.values.size(), 2u);
      for (const LabValue& value : report.values)
        EXPECT_NEAR(relative_error(value), 0, 0.01) << value.quantity;
    }
}

TEST_P(LabOnTriangles, CylindersMeasureTheRigidityInEveryDirectionWithinOnePercent) {
  const LabReport report = run(LabTest::kBending, {0.02, 0.01});
  ASSERT_EQ(report.values.size(), 8u);
  for (const LabValue& value : report.values)
    EXPECT_NEAR(relative_error(value), 0, 0.01) << value.quantity;
}

TEST_P(LabOnTriangles, ACantileverHangsWithinHalfADegreeOfTheStandardFrom1To8Millimetres) {
  const LabReport report = run(LabTest::kCantilever, {0.001, 0.002, 0.004, 0.0065, 0.008});
  ASSERT_EQ(report.values.size(), 5u);
  for (const LabValue& value : report.values) EXPECT_NEAR(value.found, 41.5, 0.5) << value.spacing;
  EXPECT_GT(report.values.back().spacing, 0.0075);
  for (const std::string& note : report.notes) ADD_FAILURE() << note;
}

TEST_P(LabOnTriangles, AChainHangsAsACatenary) {
  const LabReport report = run(LabTest::kChain, {0.03, 0.0075});
  EXPECT_LT(std::abs(relative_error(report.values[0])), 0.015);
  EXPECT_LT(std::abs(relative_error(report.values[1])), 2e-3);
}

TEST_P(LabOnTriangles, AStiffDiscBendsAsAnAnnularPlateDoes) {
  constexpr double kRigidity = 0.1, kRadius = 0.15, kHeld = 0.09, kSpacing = 0.0075;
  MeasuredTextile board = wool();
  board.bend_rigidity_warp = board.bend_rigidity_weft = kRigidity;
  const Specimen disc = cut_disc(board, Isometric{}, GetParam(), kRadius, kHeld, kSpacing);
  const Equilibrium rest =
      find_equilibrium(disc.mesh, disc.held, {0, -kStandardGravity, 0}, disc.start, 1e-8);
  ASSERT_TRUE(rest.found);
  const AnnularPlate plate(kRigidity, board.areal_density * kStandardGravity, kHeld, kRadius);
  double found = 0, asked = 0;
  for (Eigen::Index i = 0; i < rest.x.cols(); ++i) {
    if (disc.held[i] != 0) continue;
    found -= disc.mesh.mass[i] * rest.x(1, i);
    asked += disc.mesh.mass[i] * plate.deflection(std::hypot(disc.start(0, i), disc.start(2, i)));
  }
  RecordProperty("share", std::to_string(found / asked));
  EXPECT_NEAR(found / asked, 1, 0.2);  // by where a clamp on particles acts
}

TEST(Lab, TrianglesBendByTheIsometricLawAlone) {
  const LabOrder order{LabTest::kTensile, wool(), ChoiKo{}, false, {}, Cut::kRight};
  EXPECT_THAT(find_problems(order), ElementsAre(Field(&Problem::field, "bending")));
}

}  // namespace
}  // namespace weft::testing
