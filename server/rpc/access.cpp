#include "server/rpc/access.h"

#include <grpc/grpc_security_constants.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "server/rpc/errors.h"

namespace weft {
namespace {

using Hash = std::array<unsigned char, 32>;

std::optional<Hash> read_hash(const std::string& digits) {
  Hash hash;
  if (digits.size() != 2 * hash.size()) return std::nullopt;
  for (std::size_t i = 0; i < hash.size(); ++i) {
    const char* pair = digits.data() + 2 * i;
    const auto [end, error] = std::from_chars(pair, pair + 2, hash[i], 16);
    if (error != std::errc() || end != pair + 2) return std::nullopt;
  }
  return hash;
}

// The subject's common name, else the first of its other names.
std::optional<std::string> name_in(const grpc::AuthContext& certificate) {
  for (const char* property : {GRPC_X509_CN_PROPERTY_NAME, GRPC_X509_SAN_PROPERTY_NAME}) {
    const auto names = certificate.FindPropertyValues(property);
    if (!names.empty() && !names.front().empty())
      return std::string(names.front().data(), names.front().size());
  }
  return std::nullopt;
}

}  // namespace

Access::Access(const std::optional<std::string>& tokens, bool by_certificate)
    : by_token_(tokens.has_value()), by_certificate_(by_certificate) {
  if (!tokens) return;
  std::ifstream file(*tokens);
  std::string line;
  for (int number = 1; std::getline(file, line); ++number)
    add(std::move(line), *tokens + ":" + std::to_string(number));
  if (!file.eof()) throw std::runtime_error("cannot read " + *tokens + ": " + std::strerror(errno));
  if (tokens_.empty()) throw std::runtime_error(*tokens + " has no line PRINCIPAL SHA256");
}

void Access::add(std::string line, const std::string& where) {
  line.erase(std::min(line.find('#'), line.size()));
  std::istringstream words(line);
  std::string principal, digits, admin, more;
  words >> principal >> digits >> admin >> more;
  if (principal.empty()) return;
  const auto hash = read_hash(digits);
  if (!hash || !(admin.empty() || admin == "admin") || !more.empty()) {
    throw std::runtime_error(where +
                             ": is not PRINCIPAL SHA256 or PRINCIPAL SHA256 admin, with 64 "
                             "hexadecimal digits; weft token writes such lines");
  }
  const auto same = [&](const Token& token) { return token.hash == *hash; };
  if (std::any_of(tokens_.begin(), tokens_.end(), same))
    throw std::runtime_error(where + ": this token stands in a line before");
  tokens_.push_back({*hash, principal});
  if (!admin.empty()) admins_.insert(principal);
}

std::variant<Caller, grpc::Status> Access::caller(const grpc::ServerContextBase& context) const {
  if (!by_token_ && !by_certificate_) return Caller{{}, true};
  constexpr std::string_view kScheme = "Bearer ";
  const auto& metadata = context.client_metadata();
  const auto given = metadata.find("authorization");
  if (by_token_ && given != metadata.end()) {
    const std::string_view value(given->second.data(), given->second.size());
    if (value.starts_with(kScheme)) return find(value.substr(kScheme.size()));
  }
  if (!by_certificate_)
    return errors::unauthenticated(
        "TOKEN_MISSING",
        "the call has no token; send \"authorization: Bearer TOKEN\" (weft --token-file)");
  if (const auto name = name_in(*context.auth_context())) return caller_called(*name);
  return errors::unauthenticated("CERTIFICATE_NAMELESS", "the client's certificate names nobody");
}

std::variant<Caller, grpc::Status> Access::find(std::string_view token) const {
  Hash hash;
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash.data());
  const Token* found = nullptr;
  for (const Token& known : tokens_)  // all of them, so that the time tells nothing
    if (CRYPTO_memcmp(known.hash.data(), hash.data(), hash.size()) == 0) found = &known;
  if (found != nullptr) return caller_called(found->principal);
  return errors::unauthenticated(
      "TOKEN_UNKNOWN", "the server does not know this token; weftd --tokens has those it knows");
}

}  // namespace weft
