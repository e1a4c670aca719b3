#include "server/rpc/textile_service.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/textiles/catalogue.h"

namespace weft::testing {
namespace {

using google::protobuf::util::MessageDifferencer;

class TextileServiceTest : public ::testing::Test {
 protected:
  grpc::Status get(const std::string& name, v1::TextilePreset& preset) {
    grpc::ClientContext context;
    v1::GetTextileRequest request;
    request.set_name(name);
    return stub_->GetTextile(&context, request, &preset);
  }

  const Access access_{std::nullopt, false};
  TextileService service_{access_};
  std::unique_ptr<grpc::Server> server_ =
      grpc::ServerBuilder().RegisterService(&service_).BuildAndStart();
  std::unique_ptr<v1::TextileService::Stub> stub_ =
      v1::TextileService::NewStub(server_->InProcessChannel({}));
};

template <class Detail>
Detail detail(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  Detail result;
  for (const auto& any : details.details()) {
    if (any.UnpackTo(&result)) return result;
  }
  ADD_FAILURE() << "no " << Detail::descriptor()->full_name();
  return result;
}

TEST_F(TextileServiceTest, lists_every_preset_the_incomplete_ones_too) {
  grpc::ClientContext context;
  v1::ListTextilesResponse list;
  ASSERT_TRUE(stub_->ListTextiles(&context, {}, &list).ok());
  ASSERT_EQ(list.textiles_size(), static_cast<int>(presets().size()));
  int incomplete = 0;
  for (int i = 0; i < list.textiles_size(); ++i) {
    EXPECT_TRUE(MessageDifferencer::Equals(list.textiles(i), presets()[static_cast<size_t>(i)]));
    incomplete += list.textiles(i).missing().empty() ? 0 : 1;
  }
  EXPECT_EQ(incomplete, 3);
}

TEST_F(TextileServiceTest, gives_one_preset_by_name) {
  for (const char* name : {"textiles/wool_tropical", "wool_tropical"}) {
    v1::TextilePreset preset;
    ASSERT_TRUE(get(name, preset).ok()) << name;
    EXPECT_TRUE(MessageDifferencer::Equals(preset, *find_preset("wool_tropical")));
  }
}

TEST_F(TextileServiceTest, says_which_textile_there_is_not) {
  for (const std::string& name :
       {std::string("textiles/tweed"), std::string("sessions/wool_tropical"),
        std::string(100'000, 'x')}) {
    v1::TextilePreset preset;
    const grpc::Status status = get(name, preset);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
    EXPECT_EQ(detail<google::rpc::ErrorInfo>(status).reason(), "TEXTILE_NOT_FOUND");
    EXPECT_EQ(detail<google::rpc::ErrorInfo>(status).domain(), "weft.v1");
    const auto resource = detail<google::rpc::ResourceInfo>(status);
    EXPECT_EQ(resource.resource_type(), "weft.v1/Textile");
    EXPECT_EQ(resource.resource_name().substr(0, 14), name.substr(0, 14));
    EXPECT_LT(status.error_details().size(), 4096U);
  }
}

TEST_F(TextileServiceTest, refuses_an_empty_name) {
  v1::TextilePreset preset;
  const grpc::Status status = get("", preset);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(detail<google::rpc::ErrorInfo>(status).reason(), "FIELD_INVALID");
  EXPECT_EQ(detail<google::rpc::BadRequest>(status).field_violations(0).field(), "name");
}

}  // namespace
}  // namespace weft::testing
