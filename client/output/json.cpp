#include "client/output/json.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>

namespace weft::client {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

// Protobuf writes 64-bit integers as strings; ours are small enough to be numbers.
void make_integers_numbers(Json& object, const Descriptor& type) {
  for (auto& [key, value] : object.items()) {
    const FieldDescriptor* field = type.FindFieldByName(key);
    if (field == nullptr) continue;
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_INT64) {
      const auto to_number = [](Json& text) { text = std::stoll(text.get<std::string>()); };
      if (field->is_repeated())
        std::for_each(value.begin(), value.end(), to_number);
      else
        to_number(value);
    } else if (field->is_repeated() && field->message_type() != nullptr) {
      for (auto& element : value) make_integers_numbers(element, *field->message_type());
    } else if (value.is_object()) {
      make_integers_numbers(value, *field->message_type());
    }
  }
}

}  // namespace

Json to_json(const google::protobuf::Message& message, Defaults defaults) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = defaults == Defaults::kShown;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw std::logic_error(status.ToString());
  Json json = Json::parse(text);
  make_integers_numbers(json, *message.GetDescriptor());
  return json;
}

Json to_json(const Problem& problem) {
  Json violations = Json::array();
  for (const auto& [field, description] : problem.violations) {
    violations.push_back({{"field", field}, {"description", description}});
  }
  return {{"error",
           {{"code", problem.code},
            {"reason", problem.reason},
            {"message", problem.what()},
            {"violations", std::move(violations)}}}};
}

}  // namespace weft::client
