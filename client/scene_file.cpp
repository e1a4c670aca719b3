#include "client/scene_file.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <tuple>

#include "client/input_file.h"
#include "client/output/json.h"
#include "client/problem.h"

namespace weft::client {
namespace {

// "line 3, column 7: ..." of the JSON parser's "[json...] parse error at line 3, column 7: ..."
void check_syntax(const std::string& path, const std::string& text) {
  try {
    std::ignore = Json::parse(text);
  } catch (const Json::parse_error& error) {
    const std::string_view what = error.what();
    const std::size_t line = what.find("line ");
    throw malformed(path, line == std::string_view::npos ? what : what.substr(line));
  }
}

// Line of a word that stands in quotes just once, as ", line 7".
std::string line_of(const std::string& word, const std::string& text) {
  const std::string quoted = '"' + word + '"';
  const std::size_t place = text.find(quoted);
  if (place == std::string::npos || text.find(quoted, place + 1) != std::string::npos) return {};
  return fmt::format(
      ", line {}",
      1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n'));
}

// "sheets[0].grid" of "session.scene.sheets[0].grid"
std::string place_in_file(std::string field) {
  constexpr std::string_view kPrefix = "session.scene.";
  if (field.starts_with(kPrefix)) field.erase(0, kPrefix.size());
  return field;
}

void read(const std::string& path, google::protobuf::Message& into) {
  const std::string text = read_text(path);
  check_syntax(path, text);
  const auto status = google::protobuf::util::JsonStringToMessage(text, &into);
  if (status.ok()) return;

  // protobuf says "(sheets[0].grid) rowz: Cannot find field."
  constexpr std::string_view kUnknown = ": Cannot find field.";
  const std::string message(status.message());
  if (!message.ends_with(kUnknown)) throw malformed(path, message);
  std::string place = message.substr(0, message.size() - kUnknown.size());
  const std::string word = place.substr(place.rfind(' ') + 1);
  if (place.starts_with('('))
    place = fmt::format("{}.{}", place.substr(1, place.find(')') - 1), word);
  throw malformed(path + line_of(word, text), "no such field: " + place);
}

}  // namespace

v1::Scene read_scene(const std::string& path) {
  v1::Scene scene;
  read(path, scene);
  return scene;
}

v1::Textile read_textile(const std::string& path) {
  v1::Textile textile;
  read(path, textile);
  return textile;
}

v1::Session create_session(Connection& connection, const v1::Scene& scene,
                           v1::CreateSessionRequest request) try {
  *request.mutable_session()->mutable_scene() = scene;
  return connection.call(&v1::SessionService::Stub::CreateSession, request);
} catch (const Problem& problem) {
  if (problem.code == "RESOURCE_EXHAUSTED" && problem.reason.empty()) {  // of gRPC itself
    throw Problem(problem.exit, problem.code, "REQUEST_TOO_LARGE",
                  fmt::format("the scene's {} bytes are more than a request may have ({})",
                              scene.ByteSizeLong(), problem.what()));
  }
  Problem placed(problem.exit, problem.code, problem.reason, place_in_file(problem.what()));
  for (const auto& [field, description] : problem.violations) {
    placed.violations.push_back({place_in_file(field), description});
  }
  throw placed;
}

std::string scene_text(const v1::Scene& scene) {
  return to_json(scene, Defaults::kLeftOut).dump(2) + '\n';
}

}  // namespace weft::client
