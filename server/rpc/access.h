#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/session/session.h"

namespace weft {

// Who calls.
struct Caller {
  std::string principal;  // empty where the server does not ask for one
  bool is_admin = false;  // may use every session

  bool may_use(const std::string& owner) const { return is_admin || owner == principal; }
  bool may_use(const Session& session) const { return may_use(session.owner()); }
};

// Knows callers by their tokens or certificates. Every method of weft.v1 asks it first.
class Access {
 public:
  // tokens: a file of lines "PRINCIPAL SHA256", with " admin" behind it for those who may use every
  // session; SHA256 is that of the token, in hexadecimal digits. by_certificate: who sends no token
  // is whom his certificate names. With neither everybody is an admin without a name. Throws
  // std::runtime_error with path and line of what is wrong.
  Access(const std::optional<std::string>& tokens, bool by_certificate);

  // The caller, or why the call is refused.
  std::variant<Caller, grpc::Status> caller(const grpc::ServerContextBase& context) const;

 private:
  struct Token {
    std::array<unsigned char, 32> hash;  // SHA-256
    std::string principal;
  };
  void add(std::string line, const std::string& where);
  std::variant<Caller, grpc::Status> find(std::string_view token) const;
  Caller caller_called(const std::string& principal) const {
    return {principal, admins_.contains(principal)};
  }

  const bool by_token_, by_certificate_;
  std::vector<Token> tokens_;
  std::set<std::string> admins_;
};

}  // namespace weft
