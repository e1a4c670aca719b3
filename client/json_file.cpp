#include "client/json_file.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>

#include "client/input_file.h"
#include "client/problem.h"

namespace weft::client {
namespace {

// Line of a word that stands in quotes just once, as ", line 7".
std::string line_of(const std::string& word, const std::string& text) {
  const std::string quoted = '"' + word + '"';
  const std::size_t place = text.find(quoted);
  if (place == std::string::npos || text.find(quoted, place + 1) != std::string::npos) return {};
  return fmt::format(
      ", line {}",
      1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n'));
}

}  // namespace

// "line 3, column 7: ..." of the JSON parser's "[json...] parse error at line 3, column 7: ..."
Json parse_json(const std::string& path, const std::string& text) {
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    const std::string_view what = error.what();
    const std::size_t line = what.find("line ");
    throw malformed(path, line == std::string_view::npos ? what : what.substr(line));
  }
}

void read_json(const std::string& path, google::protobuf::Message& into) {
  const std::string text = read_text(path);
  parse_json(path, text);
  read_message(path, text, into);
}

void read_message(const std::string& path, const std::string& text,
                  google::protobuf::Message& into) {
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

}  // namespace weft::client
