#include "server/credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <spdlog/spdlog.h>

#include <filesystem>

#include "server/pem.h"

namespace weft {
namespace {

constexpr unsigned kLookAgainSeconds = 2;

void warn_of_readers(const std::string& key) {
  namespace fs = std::filesystem;
  std::error_code error;
  const auto permissions = fs::status(key, error).permissions();
  if (!error && (permissions & fs::perms::others_read) != fs::perms::none)
    spdlog::warn("{} can be read by others; take that right away: chmod o-r {}", key, key);
}

}  // namespace

std::shared_ptr<grpc::ServerCredentials> make_credentials(const std::optional<ServerTls>& tls) {
  if (!tls) return grpc::InsecureServerCredentials();
  read_key_pair(tls->certificate, tls->key);
  if (tls->client_ca) read_certificates(*tls->client_ca);
  warn_of_readers(tls->key);

  // of a pair that does not match while it is replaced, it lets nobody in until it does
  namespace experimental = grpc::experimental;
  experimental::TlsServerCredentialsOptions options(
      std::make_shared<experimental::FileWatcherCertificateProvider>(
          tls->key, tls->certificate, tls->client_ca.value_or(""), kLookAgainSeconds));
  options.watch_identity_key_cert_pairs();
  if (tls->client_ca) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return experimental::TlsServerCredentials(options);
}

}  // namespace weft
