#include "core/repairs.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace weft {
namespace {

constexpr double kFrameStep = 0.016;

StepPlan ten_substeps() {
  StepPlan step;
  step.substeps = 10;
  step.substep = kFrameStep / 10;
  return step;
}

Repairs repairs_of_at_most(int most) {
  SolverSettings settings;
  settings.frame_step = kFrameStep;
  settings.max_repairs = most;
  Repairs repairs(settings);
  repairs.begin_frame();
  return repairs;
}

// Of one sheet, which stretched.
Attempt in_doubt(double strain) {
  return {{{.reason = "strain", .strain = strain}}, "sheet: strain"};
}
const Attempt kGood{{{}}, ""};

TEST(Repairs, AFrameThatIsTrustedKeepsItsStep) {
  Repairs repairs = repairs_of_at_most(12);
  StepPlan step = ten_substeps();
  EXPECT_EQ(repairs.judge(1, kGood, step), Decision::kDone);
  EXPECT_EQ(step.substeps, 10);
  EXPECT_TRUE(repairs.all().empty());
}

TEST(Repairs, AFrameInDoubtIsComputedAgainWithHalfTheStepWhichStays) {
  Repairs repairs = repairs_of_at_most(12);
  StepPlan step = ten_substeps();
  EXPECT_EQ(repairs.judge(7, in_doubt(20), step), Decision::kAgain);
  EXPECT_EQ(step.substeps, 20);
  EXPECT_DOUBLE_EQ(step.substep, kFrameStep / 20);
  EXPECT_EQ(repairs.judge(7, kGood, step), Decision::kDone);
  ASSERT_EQ(repairs.all().size(), 1U);
  EXPECT_EQ(repairs.all()[0].frame, 7);
  EXPECT_DOUBLE_EQ(repairs.all()[0].substep, kFrameStep / 20);
  EXPECT_EQ(repairs.all()[0].reason, "sheet: strain");

  StepPlan planned_anew = ten_substeps();
  repairs.shorten(planned_anew);
  EXPECT_EQ(planned_anew.substeps, 20);
}

TEST(Repairs, WhereHalfTheStepShowsTheSameTheLongerStepWasRight) {
  Repairs repairs = repairs_of_at_most(12);
  StepPlan step = ten_substeps();
  ASSERT_EQ(repairs.judge(1, in_doubt(20), step), Decision::kAgain);
  EXPECT_EQ(repairs.judge(1, in_doubt(21), step), Decision::kConfirmed);
  EXPECT_EQ(step.substeps, 10);
  EXPECT_TRUE(repairs.all().empty());
}

TEST(Repairs, WhatTwoStepsShowDifferentlyIsHalvedAgain) {
  Repairs repairs = repairs_of_at_most(12);
  StepPlan step = ten_substeps();
  ASSERT_EQ(repairs.judge(1, in_doubt(80), step), Decision::kAgain);
  EXPECT_EQ(repairs.judge(1, in_doubt(20), step), Decision::kAgain);
  EXPECT_EQ(step.substeps, 40);
  EXPECT_EQ(repairs.judge(1, in_doubt(21), step), Decision::kConfirmed);
  EXPECT_EQ(step.substeps, 20);
  EXPECT_EQ(repairs.all().size(), 1U);
}

TEST(Repairs, WhereClothPassesThroughClothTwoShorterStepsAreTried) {
  Repairs repairs = repairs_of_at_most(12);
  StepPlan step = ten_substeps();
  const Attempt tangled{{{}}, "cuts", true};
  EXPECT_EQ(repairs.judge(1, tangled, step), Decision::kAgain);
  EXPECT_EQ(repairs.tangled(), 1);
  EXPECT_EQ(repairs.judge(1, kGood, step), Decision::kDone);
  EXPECT_EQ(step.substeps, 20);
  EXPECT_EQ(repairs.all().size(), 1U);
  repairs.begin_frame();
  EXPECT_EQ(repairs.judge(2, tangled, step), Decision::kAgain);
  EXPECT_EQ(repairs.judge(2, tangled, step), Decision::kAgain);
  EXPECT_EQ(step.substeps, 80);
  EXPECT_EQ(repairs.judge(2, tangled, step), Decision::kConfirmed);
  EXPECT_EQ(step.substeps, 20);
  EXPECT_EQ(repairs.all().size(), 1U);
}

TEST(Repairs, WhereClothPassesThroughClothNoFrameFailsForIt) {
  Repairs none = repairs_of_at_most(0);
  StepPlan step = ten_substeps();
  EXPECT_EQ(none.judge(1, {{{}}, "cuts", true}, step), Decision::kDone);
  EXPECT_EQ(step.substeps, 10);
}

TEST(Repairs, AnAttemptAtTheFrameBeforeConfirmsNothing) {
  Repairs repairs = repairs_of_at_most(12);
  StepPlan step = ten_substeps();
  ASSERT_EQ(repairs.judge(1, in_doubt(20), step), Decision::kAgain);
  repairs.begin_frame();
  EXPECT_EQ(repairs.judge(2, in_doubt(20), step), Decision::kAgain);
}

TEST(Repairs, EndWhereTheyAreUsedUpOrAFrameWouldCostTooMuch) {
  StepPlan step = ten_substeps();
  Repairs none = repairs_of_at_most(0);
  EXPECT_EQ(none.judge(1, in_doubt(20), step), Decision::kImpossible);
  Repairs limited = repairs_of_at_most(12);
  limited.limit_substeps(39);
  EXPECT_EQ(limited.judge(1, in_doubt(80), step), Decision::kAgain);
  EXPECT_EQ(limited.judge(1, in_doubt(20), step), Decision::kImpossible);
  EXPECT_EQ(step.substeps, 20);
}

}  // namespace
}  // namespace weft
