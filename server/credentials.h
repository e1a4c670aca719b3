#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <optional>
#include <string>

namespace weft {

// Files in PEM, read anew when they change.
struct ServerTls {
  std::string certificate, key;          // a chain, and what belongs to its first
  std::optional<std::string> client_ca;  // clients need a certificate that one of these signed
};

// Without TLS for nullopt. Throws std::runtime_error with the path of what cannot be used; warns of
// a key that others can read.
std::shared_ptr<grpc::ServerCredentials> make_credentials(const std::optional<ServerTls>& tls);

}  // namespace weft
