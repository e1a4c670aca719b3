#include "server/session/stats.h"

#include <chrono>
#include <ctime>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/support/service/service.h"

namespace weft::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

TEST(DurationHistogram, PutsADurationIntoTheFirstBucketThatHoldsIt) {
  DurationHistogram histogram;
  histogram.add(0s);
  histogram.add(64us);
  histogram.add(65us);
  histogram.add(24h);
  EXPECT_EQ(histogram.count(0), 2);
  EXPECT_EQ(histogram.count(1), 1);
  EXPECT_EQ(histogram.count(DurationHistogram::kBuckets - 1), 1);
  EXPECT_NEAR(histogram.sum(), 86400 + 129e-6, 1e-9);
}

v1::ServerStats stats_of(Service& service) {
  grpc::ClientContext context;
  v1::ServerStats stats;
  EXPECT_TRUE(service.servers->GetServerStats(&context, {}, &stats).ok());
  return stats;
}

TEST(ServerStats, CountWhatWasComputedAndSent) {
  Service service;
  const v1::Session session = service.create();
  service.create();
  service.step(session, 10);
  EXPECT_THAT(Stream(service, frames_of(session, 0, 10)).rest(), ::testing::SizeIs(11));

  const v1::ServerStats stats = stats_of(service);
  EXPECT_EQ(stats.sessions().paused(), 2);
  EXPECT_EQ(stats.sessions().running(), 0);
  EXPECT_EQ(stats.frames(), 10);
  EXPECT_EQ(stats.substeps(), 10 * session.plan().substeps_per_frame());
  EXPECT_EQ(stats.particle_substeps(), 20 * stats.substeps());
  EXPECT_EQ(stats.frames_sent(), 11);
  EXPECT_GT(stats.bytes_sent(), 11 * 20 * 3 * 4);
  std::int64_t timed = 0;
  for (const std::int64_t count : stats.frame_time_s().counts()) timed += count;
  EXPECT_EQ(timed, 10);
}

TEST(Verdict, TellsWhatASessionTookOfTheProcessors) {
  Service service;
  const std::clock_t begin = std::clock();  // of all threads
  const v1::Session session = service.create();
  service.step(session, 100);
  v1::GetVerdictRequest request;
  request.set_name(session.name());
  v1::Verdict verdict;
  ASSERT_TRUE(service.call(&Service::Sessions::GetVerdict, request, &verdict).ok());
  const double took = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  EXPECT_EQ(verdict.substep_count(), 100 * session.plan().substeps_per_frame());
  EXPECT_GT(verdict.computing_s(), 0);
  EXPECT_LE(verdict.computing_s(), took);
}

TEST(ServerStats, SayWhatFramesTakeWhichAllSessionsTogetherKeepWithinTheirBound) {
  ServerOptions options = Service::in_process();
  options.limits.max_total_history_bytes = 400'000;  // some 350 frames of the small scene
  Service service(options);
  const auto kept = [&] { return stats_of(service).history_bytes(); };
  const v1::Session first = service.create();
  service.step(first, 1000);
  EXPECT_GT(kept(), 390'000);
  EXPECT_LE(kept(), 400'000);
  // it makes room when others come, though nobody calls it any more
  for (int i = 0; i < 3; ++i) service.step(service.create(), 1000);
  const auto until = std::chrono::steady_clock::now() + 30s;
  while (kept() > 400'000 && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(10ms);
  EXPECT_LE(kept(), 400'000);
  EXPECT_GT(kept(), 390'000);
  EXPECT_THAT(Stream(service, frames_of(first, 980, 1000)).rest(), ::testing::SizeIs(21));
}

TEST(ServerStats, CountOpenStreams) {
  Service service;
  const v1::Session session = service.create();
  {
    Stream stream(service, frames_of(session));
    stream.header();
    EXPECT_EQ(stats_of(service).streams(), 1);
  }
  while (stats_of(service).streams() > 0) {
  }
}

TEST(ServerStats, SayHowLatePacedFramesAre) {
  Service service;
  const v1::Session session = service.create();
  v1::RunSessionRequest request;
  request.set_name(session.name());
  request.set_time_scale(1000);  // 16.7 us a frame: too fast
  request.set_until_frame(50);
  v1::RunSessionResponse response;
  ASSERT_TRUE(service.call(&Service::Sessions::RunSession, request, &response).ok());
  while (service.get(session).frame() < 50) {
  }
  EXPECT_GT(service.get(session).lateness_s(), 0);
  EXPECT_GT(stats_of(service).lateness_s().sum(), 0);
}

TEST(Metrics, TellPrometheusTheSame) {
  ServerOptions options = Service::in_process();
  options.metrics = "127.0.0.1:0";
  Service service(options);
  const v1::Session session = service.create();
  service.step(session, 10);
  const std::string text = metrics_at(service.server.metrics_address());
  EXPECT_THAT(text, HasSubstr("200 OK"));
  EXPECT_THAT(text, HasSubstr("\nweft_frames_total 10\n"));
  EXPECT_THAT(text, HasSubstr("\nweft_sessions{state=\"paused\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("\nweft_frame_time_seconds_count 10\n"));
}

TEST(Metrics, AtAnAddressThatCannotBeHadKeepTheServerFromStarting) {
  ServerOptions options = Service::in_process();
  options.metrics = "192.0.2.1:9464";  // no machine has it (RFC 5737)
  EXPECT_THROW(Service{options}, std::runtime_error);
}

}  // namespace
}  // namespace weft::testing
