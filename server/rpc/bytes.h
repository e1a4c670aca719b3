#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

#include <string>

// Messages of methods that pass bytes.
namespace weft {

inline grpc::ByteBuffer encoded(const google::protobuf::MessageLite& message) {
  auto* owned = new std::string(message.SerializeAsString());
  const grpc::Slice slice(
      owned->data(), owned->size(), [](void* string) { delete static_cast<std::string*>(string); },
      owned);
  return {&slice, 1};
}

// False where the bytes are no such message.
template <class Message>
bool decode(const grpc::ByteBuffer& bytes, Message& message) {
  grpc::ByteBuffer read(bytes);
  return grpc::SerializationTraits<Message>::Deserialize(&read, &message).ok();
}

}  // namespace weft
