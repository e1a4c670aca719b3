#include "client/textile_change.h"

#include "client/problem.h"

namespace weft::client {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// "raw.bend_n_m2" of "bend_n_m2", where the sheet's textile is raw.
std::string full_path(const std::string& field, const v1::Textile& present) {
  const bool known = field.find('.') != std::string::npos ||
                     v1::Textile::descriptor()->FindFieldByName(field) != nullptr;
  if (known) return field;
  return (present.has_raw() ? "raw." : "measured.") + field;
}

void set_field(v1::Textile& textile, const std::string& path, double value) {
  Message* message = &textile;
  std::string field = path;
  if (const std::size_t dot = path.find('.'); dot != std::string::npos) {
    const FieldDescriptor* model = message->GetDescriptor()->FindFieldByName(path.substr(0, dot));
    if (model == nullptr || model->message_type() == nullptr)
      throw usage_problem("a textile has no field " + path);
    message = message->GetReflection()->MutableMessage(message, model);
    field = path.substr(dot + 1);
  }
  const FieldDescriptor* target = message->GetDescriptor()->FindFieldByName(field);
  if (target == nullptr || target->cpp_type() != FieldDescriptor::CPPTYPE_DOUBLE) {
    throw usage_problem("a textile has no number " + path);
  }
  message->GetReflection()->SetDouble(message, target, value);
}

v1::Textile textile_of(const v1::Session& session, const std::string& sheet_name) {
  for (const auto& sheet : session.scene().sheets()) {
    if (sheet_name.empty() || sheet.name() == sheet_name) return sheet.textile();
  }
  return {};  // the server will say that there is no such sheet
}

}  // namespace

v1::UpdateTextileRequest textile_request(const v1::Session& session, const TextileChange& change) {
  v1::UpdateTextileRequest request;
  request.set_name(session.name());
  request.set_sheet(change.sheet);
  if (change.duration_s) request.set_duration_s(*change.duration_s);
  const v1::Textile present = textile_of(session, change.sheet);
  if (!change.preset.empty()) {
    *request.mutable_textile() = present;
    request.mutable_textile()->set_preset(change.preset);
  }
  for (const auto& [field, value] : change.values) {
    const std::string path = full_path(field, present);
    set_field(*request.mutable_textile(), path, value);
    request.mutable_update_mask()->add_paths(path);
  }
  return request;
}

}  // namespace weft::client
