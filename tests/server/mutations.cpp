#include "tests/server/mutations.h"

#include <limits>
#include <utility>

namespace weft::testing {

bool is_number(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_INT32 ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_INT64;
}

namespace {

template <class Number>
Mutation number(std::string what, bool acceptable, Number value) {
  return {std::move(what), acceptable, [value](Message& message, const FieldDescriptor& field) {
            set_number(message, field, value);
          }};
}

template <class Integer>
std::vector<Mutation> integers() {
  using Limits = std::numeric_limits<Integer>;
  return {number<Integer>("0", true, 0), number<Integer>("-1", false, -1),
          number("the largest", false, Limits::max()),
          number("the smallest", false, Limits::min())};
}

std::vector<Mutation> doubles() {
  using Limits = std::numeric_limits<double>;
  return {number("0", true, 0.0),
          number("-1", true, -1.0),
          number("denormal", true, Limits::denorm_min()),
          number("1e300", false, 1e300),
          number("NaN", false, Limits::quiet_NaN()),
          number("infinity", false, Limits::infinity()),
          number("-infinity", false, -Limits::infinity())};
}

Mutation text(std::string what, bool acceptable, std::string value) {
  return {std::move(what), acceptable, [value](Message& message, const FieldDescriptor& field) {
            const auto* r = message.GetReflection();
            if (!field.is_repeated()) return r->SetString(&message, &field, value);
            r->AddString(&message, &field, value);
          }};
}

}  // namespace

std::vector<Mutation> values(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return doubles();
    case FieldDescriptor::CPPTYPE_INT32:
      return integers<std::int32_t>();
    case FieldDescriptor::CPPTYPE_INT64:
      return integers<std::int64_t>();
    case FieldDescriptor::CPPTYPE_ENUM: {
      std::vector<Mutation> result;
      for (const int value : {-1, 9999}) {
        result.push_back(
            {"unknown value", false, [value](Message& message, const FieldDescriptor& f) {
               message.GetReflection()->SetEnumValue(&message, &f, value);
             }});
      }
      return result;
    }
    case FieldDescriptor::CPPTYPE_BOOL:
      return {{"other value", true, [](Message& message, const FieldDescriptor& f) {
                 const auto* r = message.GetReflection();
                 r->SetBool(&message, &f, !r->GetBool(message, &f));
               }}};
    case FieldDescriptor::CPPTYPE_STRING:
      return {
          text("bad text", false, "Bad Name!"), text("a long text", false, std::string(129, 'x')),
          text("a zero byte", false, std::string("a\0b", 3)), text(kBadUtf8, false, "\xff\xfe")};
    case FieldDescriptor::CPPTYPE_MESSAGE:
      if (field.is_repeated()) return {};
      return {{"empty", true, [](Message& message, const FieldDescriptor& f) {
                 message.GetReflection()->MutableMessage(&message, &f)->Clear();
               }}};
    default:
      ADD_FAILURE() << "teach this test the type of " << field.full_name();
      return {};
  }
}

std::vector<Mutation> mutations(const FieldDescriptor& field) {
  std::vector<Mutation> result = values(field);
  result.push_back({"absent", true, [](Message& message, const FieldDescriptor& f) {
                      message.GetReflection()->ClearField(&message, &f);
                    }});
  if (!field.is_repeated()) return result;
  result.push_back({"one fewer", true, [](Message& message, const FieldDescriptor& f) {
                      const auto* r = message.GetReflection();
                      if (r->FieldSize(message, &f) > 0) r->RemoveLast(&message, &f);
                    }});
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
    result.push_back({"one more", true, [](Message& message, const FieldDescriptor& f) {
                        message.GetReflection()->AddDouble(&message, &f, 0);
                      }});
  } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    result.push_back(
        {"300 more", true, [](Message& message, const FieldDescriptor& f) {
           const auto* r = message.GetReflection();
           if (r->FieldSize(message, &f) == 0) r->AddMessage(&message, &f);
           for (int i = 0; i < 300; ++i)
             r->AddMessage(&message, &f)->CopyFrom(r->GetRepeatedMessage(message, &f, 0));
         }});
  }
  return result;
}

void walk(Message& message, const std::string& path, const Visit& visit) {
  const auto* r = message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(i);
    const std::string here = (path.empty() ? "" : path + ".") + field.name();
    visit(message, field, here);
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (field.is_repeated()) {
      for (int k = 0; k < r->FieldSize(message, &field); ++k) {
        walk(*r->MutableRepeatedMessage(&message, &field, k), here + "[" + std::to_string(k) + "]",
             visit);
      }
    } else if (r->HasField(message, &field)) {
      walk(*r->MutableMessage(&message, &field), here, visit);
    }
  }
}

}  // namespace weft::testing
