#include <fuzzer/FuzzedDataProvider.h>
#include <google/protobuf/message.h>
#include <google/protobuf/stubs/logging.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "tests/support/service/assets.h"
#include "tests/support/service/service.h"

namespace {

using namespace weft;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// One that takes a moment at the most.
ServerOptions small_limits() {
  ServerOptions options = weft::testing::Service::in_process();
  options.limits.max_particles_per_session = 400;
  return options;
}

const std::string& mesh_bytes() {
  static const std::string bytes = weft::testing::square_mesh(1).SerializeAsString();
  return bytes;
}

std::string some_text(FuzzedDataProvider& input) {
  static const std::string kKnown[] = {
      "sessions/cloth", "cloth",         "sheet-1",    "wool_tropical",
      "presets/silk",   "raw.bend_n_m2", mesh_bytes(), weft::testing::name_of_asset(mesh_bytes())};
  return input.ConsumeBool() ? input.PickValueInArray(kKnown) : input.ConsumeRandomLengthString(8);
}

double some_number(FuzzedDataProvider& input) {
  static const double kKnown[] = {0, 1, 0.01, 1e-4, 5, -1, 1e6, 1e300};
  return input.ConsumeBool() ? input.PickValueInArray(kKnown)
                             : input.ConsumeFloatingPoint<double>();
}

template <class Integer>
Integer some_integer(FuzzedDataProvider& input) {
  return input.ConsumeBool() ? input.ConsumeIntegralInRange<Integer>(0, 8)
                             : input.ConsumeIntegral<Integer>();
}

// Sets or adds a value; of a message, some of its fields.
void fill(FuzzedDataProvider& input, Message& message, int depth);
void fill(FuzzedDataProvider& input, Message& message, const FieldDescriptor& field, int depth) {
  const auto& access = *message.GetReflection();
  const auto put = [&](auto set, auto add, auto value) {
    field.is_repeated() ? (access.*add)(&message, &field, std::move(value))
                        : (access.*set)(&message, &field, std::move(value));
  };
  using Access = google::protobuf::Reflection;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      if (depth > 8) return;
      return fill(input,
                  field.is_repeated() ? *access.AddMessage(&message, &field)
                                      : *access.MutableMessage(&message, &field),
                  depth + 1);
    case FieldDescriptor::CPPTYPE_STRING:
      return put(&Access::SetString, &Access::AddString, some_text(input));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return put(&Access::SetDouble, &Access::AddDouble, some_number(input));
    case FieldDescriptor::CPPTYPE_BOOL:
      return put(&Access::SetBool, &Access::AddBool, input.ConsumeBool());
    case FieldDescriptor::CPPTYPE_INT32:
      return put(&Access::SetInt32, &Access::AddInt32, some_integer<std::int32_t>(input));
    case FieldDescriptor::CPPTYPE_INT64:
      return put(&Access::SetInt64, &Access::AddInt64, some_integer<std::int64_t>(input));
    case FieldDescriptor::CPPTYPE_ENUM:
      return put(&Access::SetEnumValue, &Access::AddEnumValue, some_integer<std::int8_t>(input));
    default:
      return;
  }
}

void fill(FuzzedDataProvider& input, Message& message, int depth) {
  const auto* type = message.GetDescriptor();
  for (int i = 0; i < type->field_count(); ++i)
    for (int times = type->field(i)->is_repeated() ? 3 : 1;
         times > 0 && input.remaining_bytes() > 0 && input.ConsumeBool(); --times)
      fill(input, message, *type->field(i), depth);
}

std::string some_request(FuzzedDataProvider& input, const google::protobuf::Descriptor& type) {
  if (input.ConsumeIntegralInRange(0, 7) == 7) return input.ConsumeRemainingBytesAsString();
  auto* factory = google::protobuf::MessageFactory::generated_factory();
  const std::unique_ptr<Message> request(factory->GetPrototype(&type)->New());
  fill(input, *request, 0);
  return request->SerializeAsString();
}

// There is the session cloth, and none else; and the asset of mesh_bytes().
void tidy(weft::testing::Service& service) {
  grpc::ClientContext context;
  v1::ListSessionsResponse all;
  service.sessions->ListSessions(&context, {}, &all);
  bool there = false;
  for (const auto& session : all.sessions()) {
    if (session.name() == "sessions/cloth" && session.state() != v1::SESSION_STATE_RUNNING)
      there = true;
    else
      service.erase(session);
  }
  if (!there) service.create(weft::testing::small_scene(), "cloth");
  weft::testing::upload(*service.assets, mesh_bytes());
}

}  // namespace

// Whatever a method is sent, it answers, and no error comes out of the server itself.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const google::protobuf::LogSilencer silence;
  static weft::testing::Service service(small_limits());
  static const auto methods = weft::testing::all_methods();
  FuzzedDataProvider input(data, size);
  const auto* method = methods[input.ConsumeIntegralInRange<std::size_t>(0, methods.size() - 1)];
  if (method->name() == "StepSession") return 0;  // some would take long, rightly
  tidy(service);
  const std::string name = "/" + method->service()->full_name() + "/" + method->name();
  const auto [answer, error] = weft::testing::raw_call(
      service, name, some_request(input, *method->input_type()), method->server_streaming());
  if (error.code == grpc::StatusCode::INTERNAL || error.code == grpc::StatusCode::UNKNOWN)
    std::abort();
  return 0;
}
