#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

// Bad values for the fields of a message, made from its descriptor.
namespace weft::testing {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// A change of one field of one message.
struct Mutation {
  std::string what;
  bool acceptable;  // some field may take it
  std::function<void(Message&, const FieldDescriptor&)> apply;
};

template <class Number>
void set_number(Message& message, const FieldDescriptor& field, Number value) {
  const auto* r = message.GetReflection();
  const bool repeated = field.is_repeated();
  const bool none = repeated && r->FieldSize(message, &field) == 0;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE: {
      const auto number = static_cast<double>(value);
      if (none) return r->AddDouble(&message, &field, number);
      return repeated ? r->SetRepeatedDouble(&message, &field, 0, number)
                      : r->SetDouble(&message, &field, number);
    }
    case FieldDescriptor::CPPTYPE_INT32: {
      const auto number = static_cast<std::int32_t>(value);
      if (none) return r->AddInt32(&message, &field, number);
      return repeated ? r->SetRepeatedInt32(&message, &field, 0, number)
                      : r->SetInt32(&message, &field, number);
    }
    case FieldDescriptor::CPPTYPE_INT64: {
      const auto number = static_cast<std::int64_t>(value);
      if (none) return r->AddInt64(&message, &field, number);
      return repeated ? r->SetRepeatedInt64(&message, &field, 0, number)
                      : r->SetInt64(&message, &field, number);
    }
    default:
      ADD_FAILURE() << "teach this test the type of " << field.full_name();
  }
}

bool is_number(const FieldDescriptor& field);

// Names the mutation of a text that gRPC does not decode.
inline const std::string kBadUtf8 = "bad UTF-8";

// What may be wrong with a field.
std::vector<Mutation> mutations(const FieldDescriptor& field);

// Calls `visit` with every field of every message in the request, and its path.
using Visit = std::function<void(Message&, const FieldDescriptor&, const std::string&)>;
void walk(Message& message, const std::string& path, const Visit& visit);

}  // namespace weft::testing
