#include "client/message_field.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "client/problem.h"

namespace weft::client {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

// "sheets[0]"
struct PlacePart {
  std::string name;
  std::optional<int> index;
};

std::vector<PlacePart> parts_of(const std::string& place) {
  std::vector<PlacePart> parts;
  for (std::size_t begin = 0; begin <= place.size();) {
    const std::size_t end = std::min(place.find('.', begin), place.size());
    PlacePart part{place.substr(begin, end - begin), {}};
    if (const std::size_t bracket = part.name.find('['); bracket != std::string::npos) {
      int index = 0;
      const char* last = part.name.data() + part.name.size();
      const auto [stop, error] = std::from_chars(part.name.data() + bracket + 1, last, index);
      if (error != std::errc() || stop == last || *stop != ']' || stop + 1 != last || index < 0)
        throw usage_problem(fmt::format("{}: write an element as NAME[0]", place));
      part.index = index;
      part.name.erase(bracket);
    }
    parts.push_back(std::move(part));
    begin = end + 1;
  }
  return parts;
}

const FieldDescriptor* find_field(const Message& message, const PlacePart& part,
                                  const std::string& place) {
  const auto* descriptor = message.GetDescriptor();
  const FieldDescriptor* field = descriptor->FindFieldByName(part.name);
  if (field == nullptr) {
    std::vector<std::string> names;
    for (int i = 0; i < descriptor->field_count(); ++i)
      names.push_back(descriptor->field(i)->name());
    throw usage_problem(fmt::format("{}: no such field: {}; {} has {}", place, part.name,
                                    descriptor->name(), fmt::join(names, ", ")));
  }
  if (field->is_repeated() != part.index.has_value())
    throw usage_problem(
        fmt::format("{}: {} is {}", place, part.name,
                    part.index ? "no list" : "a list; write an element as " + part.name + "[0]"));
  if (part.index) {
    const int size = message.GetReflection()->FieldSize(message, field);
    if (*part.index > size)
      throw usage_problem(fmt::format("{}: {} has {} elements", place, part.name, size));
  }
  return field;
}

template <class Number>
Number number_of(const std::string& text, const std::string& place, const char* what) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  bool sound = error == std::errc() && end == text.data() + text.size();
  if constexpr (std::is_floating_point_v<Number>) sound = sound && std::isfinite(value);
  if (!sound) throw usage_problem(fmt::format("{}: \"{}\" is not {}", place, text, what));
  return value;
}

int enum_of(const FieldDescriptor& field, const std::string& text, const std::string& place) {
  if (const auto* value = field.enum_type()->FindValueByName(text)) return value->number();
  std::vector<std::string> names;
  for (int i = 1; i < field.enum_type()->value_count(); ++i)  // but UNSPECIFIED
    names.push_back(field.enum_type()->value(i)->name());
  throw usage_problem(fmt::format("{}: \"{}\" is none of {}", place, text, fmt::join(names, ", ")));
}

// Sets the field, or an element of it; where that is one past the last it is added.
void set_value(Message& message, const FieldDescriptor& field, std::optional<int> index,
               const std::string& text, const std::string& place) {
  const Reflection& reflection = *message.GetReflection();
  const auto put = [&](auto one, auto element, auto add, const auto& value) {
    if (!index) return (reflection.*one)(&message, &field, value);
    if (*index < reflection.FieldSize(message, &field))
      return (reflection.*element)(&message, &field, *index, value);
    (reflection.*add)(&message, &field, value);
  };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return put(&Reflection::SetDouble, &Reflection::SetRepeatedDouble, &Reflection::AddDouble,
                 number_of<double>(text, place, "a number"));
    case FieldDescriptor::CPPTYPE_INT32:
      return put(&Reflection::SetInt32, &Reflection::SetRepeatedInt32, &Reflection::AddInt32,
                 number_of<std::int32_t>(text, place, "a whole number"));
    case FieldDescriptor::CPPTYPE_BOOL:
      if (text != "true" && text != "false")
        throw usage_problem(fmt::format("{}: \"{}\" is not true or false", place, text));
      return put(&Reflection::SetBool, &Reflection::SetRepeatedBool, &Reflection::AddBool,
                 text == "true");
    case FieldDescriptor::CPPTYPE_ENUM:
      return put(&Reflection::SetEnumValue, &Reflection::SetRepeatedEnumValue,
                 &Reflection::AddEnumValue, enum_of(field, text, place));
    case FieldDescriptor::CPPTYPE_STRING:
      if (index) break;
      return reflection.SetString(&message, &field, text);
    default:
      break;
  }
  throw usage_problem(fmt::format("{}: is not a single value", place));
}

}  // namespace

void set_field(Message& message, const std::string& place, const std::string& value) {
  const std::vector<PlacePart> parts = parts_of(place);
  Message* at = &message;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    const FieldDescriptor* field = find_field(*at, parts[i], place);
    if (field->message_type() == nullptr)
      throw usage_problem(fmt::format("{}: {} has no fields", place, parts[i].name));
    const Reflection& reflection = *at->GetReflection();
    if (!parts[i].index)
      at = reflection.MutableMessage(at, field);
    else if (*parts[i].index < reflection.FieldSize(*at, field))
      at = reflection.MutableRepeatedMessage(at, field, *parts[i].index);
    else
      at = reflection.AddMessage(at, field);
  }
  set_value(*at, *find_field(*at, parts.back(), place), parts.back().index, value, place);
}

}  // namespace weft::client
