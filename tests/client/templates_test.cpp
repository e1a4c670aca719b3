#include "client/templates/templates.h"

#include <gmock/gmock.h>

#include <cmath>
#include <set>
#include <string>

#include "client/problem.h"
#include "client/textile_file.h"
#include "tests/support/service/service.h"

namespace weft::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kPaper[] = {"paper-1", "paper-2", "paper-3", "paper-4"};
constexpr const char* kGeneral[] = {"hang", "box", "sphere", "flag", "cantilever"};

const v1::Sheet& only_sheet(const v1::Scene& scene) {
  EXPECT_EQ(scene.sheets_size(), 1);
  return scene.sheets(0);
}

std::set<int> pinned(const v1::Sheet& sheet) {
  std::set<int> result;
  for (const v1::Pin& pin : sheet.pins()) {
    EXPECT_TRUE(pin.path().empty());
    result.insert(pin.particles().begin(), pin.particles().end());
  }
  return result;
}

TEST(Templates, are_listed_with_a_description) {
  std::vector<std::string> names;
  for (const TemplateInfo& info : templates()) {
    names.push_back(info.name);
    EXPECT_FALSE(info.description.empty()) << info.name;
  }
  EXPECT_THAT(names, ElementsAre("hang", "box", "sphere", "flag", "cantilever", "load", "paper-1",
                                 "paper-2", "paper-3", "paper-4"));
}

TEST(Templates, of_the_paper_have_its_sheet_air_and_time) {
  for (const char* name : kPaper) {
    SCOPED_TRACE(name);
    const v1::Scene scene = make_template(name);
    const v1::Sheet& sheet = only_sheet(scene);
    EXPECT_EQ(sheet.grid().rows(), 31);
    EXPECT_EQ(sheet.grid().columns(), 31);
    EXPECT_DOUBLE_EQ(sheet.grid().spacing_m(), 1.0 / 30);
    EXPECT_FALSE(sheet.placement().has_rotation());  // level
    const v1::RawTextile& textile = sheet.textile().raw();
    EXPECT_EQ(textile.particle_mass_kg(), 0.001);
    EXPECT_EQ(textile.stretch_n_per_m(), 2000);
    EXPECT_EQ(textile.shear_n_per_m(), 2000);
    EXPECT_EQ(textile.clamp_n_per_m(), 2000);
    EXPECT_EQ(textile.air_drag_kg_per_s(), 1e-3);
    EXPECT_DOUBLE_EQ(textile.bend_n_m2(), 0.1 * 1e-4);
    EXPECT_EQ(sheet.textile().damping_kg_per_s(), 2e-4);
    EXPECT_EQ(scene.environment().gravity_m_per_s2().x(), 0);
    EXPECT_EQ(scene.environment().gravity_m_per_s2().y(), -9.8);
    EXPECT_EQ(scene.environment().gravity_m_per_s2().z(), 0);
    EXPECT_EQ(scene.solver().frame_step_s(), 0.1);
  }
}

TEST(Templates, take_k_b_in_the_unit_of_the_paper) {
  for (const double bend : {0.0, 0.1, 0.2, 0.3}) {
    const v1::Scene scene = make_template("paper-3", {.bend = bend});
    EXPECT_DOUBLE_EQ(only_sheet(scene).textile().raw().bend_n_m2(), bend * 1e-4);
  }
}

TEST(Templates, hang_the_paper_s_first_sheet_from_two_corners) {
  const v1::Scene scene = make_template("paper-1");
  EXPECT_EQ(pinned(only_sheet(scene)), (std::set{0, 30}));
  EXPECT_TRUE(scene.colliders().empty());
}

TEST(Templates, drop_the_paper_s_other_sheets_freely) {
  for (const char* name : {"paper-2", "paper-3", "paper-4"}) {
    const v1::Scene scene = make_template(name);
    EXPECT_TRUE(only_sheet(scene).pins().empty()) << name;
    ASSERT_EQ(scene.colliders_size(), 1) << name;
  }
  EXPECT_EQ(make_template("paper-3").colliders(0).sphere().radius_m(), 0.3);
  EXPECT_EQ(make_template("paper-4").colliders(0).sphere().radius_m(), 0.3);
  EXPECT_TRUE(make_template("paper-2").colliders(0).has_box());
}

TEST(Templates, start_a_falling_sheet_centred_and_a_few_millimetres_above_its_body) {
  for (const char* name : {"box", "sphere", "paper-2", "paper-3", "paper-4"}) {
    SCOPED_TRACE(name);
    const v1::Scene scene = make_template(name);
    const v1::Sheet& sheet = only_sheet(scene);
    const v1::Collider& body = scene.colliders(0);
    const v1::Vector3& center = body.has_box() ? body.box().center_m() : body.sphere().center_m();
    const double top =
        center.y() + (body.has_box() ? body.box().half_size_m().y() : body.sphere().radius_m());
    const v1::Vector3& origin = sheet.placement().origin_m();
    const double half = 15 * sheet.grid().spacing_m();
    EXPECT_NEAR(origin.x() + half, center.x(), 1e-15);
    EXPECT_NEAR(origin.z() + half, center.z(), 1e-15);
    EXPECT_GT(origin.y() - top, sheet.grid().spacing_m() / 10);  // the default skin
    EXPECT_LT(origin.y() - top, 0.01);
  }
}

TEST(Templates, have_a_floor_under_the_bodies_of_ordinary_sheets) {
  for (const char* name : {"box", "sphere"}) {
    const v1::Scene scene = make_template(name);
    ASSERT_EQ(scene.colliders_size(), 2) << name;
    EXPECT_TRUE(scene.colliders(1).has_plane()) << name;
  }
}

TEST(Templates, evaluate_the_paper_s_fourth_sheet_with_segments_or_exactly) {
  const auto law = [](const TemplateOptions& options) {
    return only_sheet(make_template("paper-4", options)).bending().choi_ko();
  };
  EXPECT_EQ(law({}).evaluator(), v1::EVALUATOR_LINEARIZED);
  EXPECT_EQ(law({}).segments(), 60);
  EXPECT_FALSE(law({}).fold_clamp());
  EXPECT_EQ(law({.segments = 2}).segments(), 2);
  EXPECT_EQ(law({.segments = 5, .fold_clamp = true}).segments(), 5);
  EXPECT_TRUE(law({.segments = 5, .fold_clamp = true}).fold_clamp());
  EXPECT_FALSE(law({}).optimal_breakpoints());
  EXPECT_TRUE(law({.optimal_breakpoints = true}).optimal_breakpoints());
  const v1::ChoiKo exact = law({.evaluator = v1::EVALUATOR_EXACT});
  EXPECT_EQ(exact.evaluator(), v1::EVALUATOR_EXACT);
  EXPECT_FALSE(exact.has_segments());
}

TEST(Templates, leave_the_bending_law_to_the_server_unless_asked) {
  for (const char* name : {"hang", "paper-1", "paper-2", "paper-3"}) {
    EXPECT_FALSE(only_sheet(make_template(name)).has_bending()) << name;
    EXPECT_EQ(only_sheet(make_template(name, {.segments = 8})).bending().choi_ko().segments(), 8);
  }
}

TEST(Templates, of_general_use_wear_a_measured_textile_at_sixty_frames_a_second) {
  for (const char* name : kGeneral) {
    const v1::Scene scene = make_template(name);
    EXPECT_EQ(only_sheet(scene).textile().preset(), "wool_tropical") << name;
    EXPECT_FALSE(scene.solver().has_frame_step_s()) << name;  // 1/60
    EXPECT_FALSE(scene.environment().has_gravity_m_per_s2()) << name;
  }
}

TEST(Templates, hold_what_they_say) {
  const v1::Scene flag = make_template("flag", {.rows = 3, .columns = 4});
  EXPECT_EQ(pinned(only_sheet(flag)), (std::set{0, 4, 8}));
  const v1::Wind& wind = flag.environment().wind();
  EXPECT_GT(wind.velocity_m_per_s().x(), 0);
  EXPECT_NE(wind.velocity_m_per_s().z(), 0);
  EXPECT_GT(wind.gust(), 0);

  const v1::Scene load = make_template("load");
  EXPECT_EQ(only_sheet(load).textile().raw().particle_mass_kg(), 1e-3);
  EXPECT_EQ(only_sheet(load).textile().raw().stretch_n_per_m(), 1000);
  EXPECT_GT(load.environment().wind().gust(), 0);

  const v1::Scene strip = make_template("cantilever", {.rows = 2, .columns = 5});
  EXPECT_EQ(pinned(only_sheet(strip)), (std::set{0, 1, 5, 6}));
  EXPECT_EQ(pinned(only_sheet(make_template("hang", {.columns = 9}))), (std::set{0, 8}));
}

TEST(Templates, hang_the_strip_over_by_thirty_millimetres) {
  const v1::Grid grid = only_sheet(make_template("cantilever")).grid();
  EXPECT_DOUBLE_EQ((grid.columns() - 1.5) * grid.spacing_m(), 0.03);
  EXPECT_DOUBLE_EQ((grid.rows() - 1) * grid.spacing_m(), 0.024);
}

TEST(Templates, stand_upright_below_their_first_row) {
  const v1::Scene scene = make_template("hang");
  const v1::Rotation& q = only_sheet(scene).placement().rotation();
  // (0, 0, 1) turned by q: z = w^2 - x^2, y = -2 w x
  EXPECT_NEAR(q.w() * q.w() - q.x() * q.x(), 0, 1e-15);
  EXPECT_NEAR(-2 * q.w() * q.x(), -1, 1e-15);
  EXPECT_EQ(q.y(), 0);
  EXPECT_EQ(q.z(), 0);
  EXPECT_DOUBLE_EQ(only_sheet(scene).placement().origin_m().y(), 1);
}

TEST(Templates, take_rows_columns_spacing_and_textile) {
  for (const TemplateInfo& info : templates()) {
    SCOPED_TRACE(info.name);
    const v1::Scene scene = make_template(
        info.name,
        {.rows = 5, .columns = 6, .spacing_m = 0.07, .textile = textile_named("denim_11oz")});
    const v1::Sheet& sheet = only_sheet(scene);
    EXPECT_EQ(sheet.grid().rows(), 5);
    EXPECT_EQ(sheet.grid().columns(), 6);
    EXPECT_EQ(sheet.grid().spacing_m(), 0.07);
    EXPECT_EQ(sheet.textile().preset(), "denim_11oz");
  }
  EXPECT_DOUBLE_EQ(only_sheet(make_template("hang", {.columns = 11})).grid().spacing_m(), 0.1);
}

TEST(Templates, are_accepted_by_the_server) {
  weft::testing::Service service;
  const auto expect_accepted = [&](const std::string& name, const TemplateOptions& options) {
    grpc::ClientContext context;
    v1::CreateSessionRequest request;
    *request.mutable_session()->mutable_scene() = make_template(name, options);
    request.set_validate_only(true);
    v1::Session session;
    const grpc::Status status = service.sessions->CreateSession(&context, request, &session);
    EXPECT_TRUE(status.ok()) << name << ": " << status.error_message();
  };
  for (const TemplateInfo& info : templates()) {
    expect_accepted(info.name, {});
    expect_accepted(info.name,
                    {.textile = textile_named("denim_11oz"), .evaluator = v1::EVALUATOR_SERIES});
  }
  for (const double bend : {0.0, 0.1, 0.2, 0.3}) expect_accepted("paper-3", {.bend = bend});
  for (const int segments : {2, 5, 60}) expect_accepted("paper-4", {.segments = segments});
  expect_accepted("paper-4", {.evaluator = v1::EVALUATOR_EXACT});
}

TEST(Templates, refuse_what_they_do_not_know) {
  const auto refusal = [](const char* name, const TemplateOptions& options) -> std::string {
    try {
      make_template(name, options);
    } catch (const Problem& problem) {
      EXPECT_EQ(problem.exit, Exit::kUsage);
      return problem.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("sail", {}), HasSubstr("paper-1"));
  EXPECT_THAT(refusal("hang", {.bend = 0.1}), HasSubstr("k_b"));
  EXPECT_THAT(refusal("paper-3", {.textile = textile_named("denim_11oz"), .bend = 0.1}),
              HasSubstr("k_b"));
  for (const int count : {-1, 0, 1, 4097}) {
    EXPECT_THAT(refusal("hang", {.rows = count}), HasSubstr("4096"));
    EXPECT_THAT(refusal("flag", {.columns = count}), HasSubstr("4096"));
  }
}

}  // namespace
}  // namespace weft::client
