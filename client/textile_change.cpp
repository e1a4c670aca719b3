#include "client/textile_change.h"

#include <fmt/format.h>

#include "client/message_field.h"

namespace weft::client {
namespace {

// "raw.bend_n_m2" of "bend_n_m2", where the sheet's textile is raw.
std::string full_path(const std::string& field, const v1::Textile& present) {
  const bool known = field.find('.') != std::string::npos ||
                     v1::Textile::descriptor()->FindFieldByName(field) != nullptr;
  if (known) return field;
  return (present.has_raw() ? "raw." : "measured.") + field;
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
  if (change.textile) {
    *request.mutable_textile() = present;
    request.mutable_textile()->clear_model();
    request.mutable_textile()->MergeFrom(*change.textile);
  }
  for (const auto& [field, value] : change.values) {
    const std::string path = full_path(field, present);
    set_field(*request.mutable_textile(), path, fmt::format("{}", value));
    request.mutable_update_mask()->add_paths(path);
  }
  return request;
}

}  // namespace weft::client
