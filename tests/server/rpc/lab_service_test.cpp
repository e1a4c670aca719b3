#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/service/service.h"
#include "weft/v1/lab.grpc.pb.h"

namespace weft::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::RunTestRequest test_of(v1::LabTest test, const std::string& preset = "wool_tropical") {
  v1::RunTestRequest request;
  request.set_test(test);
  request.mutable_textile()->set_preset(preset);
  return request;
}

// Minutes of work.
v1::RunTestRequest long_test() {
  v1::RunTestRequest request = test_of(v1::LAB_TEST_TENSILE);
  for (int i = 0; i < 16; ++i) request.add_spacings_m(0.0014);
  return request;
}

// A call of RunTest.
class LabCall {
 public:
  LabCall(Service& service, const v1::RunTestRequest& request)
      : stub_(v1::LabService::NewStub(service.channel)),
        reader_(stub_->RunTest(&context_, request)) {}

  // The next message; without one, the call has ended.
  bool read() { return reader_->Read(&message); }
  void read_until_it_runs() {
    while (read() && message.progress().specimens() == 0) continue;
    EXPECT_GT(message.progress().specimens(), 0);
  }
  void cancel() { context_.TryCancel(); }
  Error finish() {
    while (read()) continue;
    return Error(reader_->Finish());
  }

  v1::RunTestResponse message;

 private:
  std::unique_ptr<v1::LabService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::RunTestResponse>> reader_;
};

Error error_of(Service& service, const v1::RunTestRequest& request) {
  return LabCall(service, request).finish();
}

TEST(LabService, ReportsProgressThenWhatWasAskedAndWhatCameOutForEachSpacing) {
  Service service;
  v1::RunTestRequest request = test_of(v1::LAB_TEST_CANTILEVER);
  request.mutable_bending()->mutable_isometric();
  request.add_spacings_m(0.006);
  request.add_spacings_m(0.004);
  LabCall call(service, request);
  int told = 0;
  while (call.read() && call.message.has_progress()) {
    EXPECT_EQ(call.message.progress().specimens(), told == 0 ? 0 : 2);
    ++told;
  }
  EXPECT_GE(told, 1);
  ASSERT_TRUE(call.message.has_report());
  const v1::LabReport report = call.message.report();
  EXPECT_EQ(call.finish().code, grpc::StatusCode::OK);

  EXPECT_THAT(report.method(), HasSubstr("D1388"));
  EXPECT_GT(report.textile().areal_density_kg_per_m2(), 0) << "not the preset's name";
  ASSERT_EQ(report.values_size(), 2);
  for (const auto& value : report.values()) {
    EXPECT_NEAR(value.asked(), 41.49, 0.01);
    EXPECT_NEAR(value.found(), 41.5, 0.5);
    EXPECT_EQ(value.unit(), "degrees");
  }
  ASSERT_EQ(report.curves_size(), 3);
  for (const auto& curve : report.curves())
    EXPECT_EQ(curve.values_size() % curve.columns_size(), 0);
}

TEST(LabService, RefusesWithEveryFieldThatIsWrong) {
  Service service;
  const auto fields = [&](const v1::RunTestRequest& request) {
    return error_of(service, request).fields();
  };
  EXPECT_THAT(fields({}), ElementsAre("test", "textile"));
  EXPECT_THAT(fields(test_of(v1::LAB_TEST_SHEAR, "cloth_of_gold")), ElementsAre("textile.preset"));
  v1::RunTestRequest raw = test_of(v1::LAB_TEST_SHEAR);
  raw.mutable_textile()->mutable_raw()->set_particle_mass_kg(1e-3);
  EXPECT_THAT(fields(raw), ElementsAre("textile.raw"));
  v1::RunTestRequest fine = test_of(v1::LAB_TEST_TENSILE);
  fine.add_spacings_m(1e-4);
  fine.add_spacings_m(std::nan(""));
  EXPECT_THAT(fields(fine), ElementsAre("spacings_m[0]", "spacings_m[1]"));
  v1::RunTestRequest bent = test_of(v1::LAB_TEST_BENDING);
  bent.mutable_bending()->mutable_choi_ko()->set_segments(0);
  bent.set_direction(static_cast<v1::LabDirection>(7));
  EXPECT_THAT(fields(bent), ElementsAre("direction", "bending.choi_ko.segments"));
}

TEST(LabService, ATestEndsWithItsCaller) {
  Service service;
  LabCall call(service, long_test());
  call.read_until_it_runs();
  call.cancel();
  EXPECT_EQ(call.finish().code, grpc::StatusCode::CANCELLED);
  EXPECT_EQ(error_of(service, test_of(v1::LAB_TEST_SHEAR)).code, grpc::StatusCode::OK)
      << "the bench is free again";
}

TEST(LabService, RunsNoMoreTestsThanItsLimit) {
  ServerOptions options = Service::in_process();
  options.limits.max_tests = 1;
  Service service(options);
  LabCall running(service, long_test());
  ASSERT_TRUE(running.read());
  const Error error = error_of(service, long_test());
  EXPECT_EQ(error.code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(error.quota.violations(0).subject(), "tests");
  EXPECT_TRUE(error.retry);
  running.cancel();
}

TEST(LabService, AServerThatStopsEndsTestsThatRunOrWait) {
  Service service;
  LabCall running(service, long_test());
  running.read_until_it_runs();
  LabCall waiting(service, long_test());
  ASSERT_TRUE(waiting.read());
  service.server.stop();
  EXPECT_EQ(running.finish().reason(), "SERVER_DRAINING");
  EXPECT_EQ(waiting.finish().reason(), "SERVER_DRAINING");
}

}  // namespace
}  // namespace weft::testing
