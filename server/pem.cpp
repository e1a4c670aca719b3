#include "server/pem.h"

#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace weft {
namespace {

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

std::string read(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file.is_open())
    throw std::runtime_error("cannot read " + path + ": " + std::strerror(errno));
  return text.str();
}

Bio bio_of(const std::string& text) {
  return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), BIO_free};
}

int no_passphrase(char*, int, int, void*) { return -1; }  // else it would ask for one

Certificate certificate_in(const std::string& text, const std::string& path) {
  Certificate certificate(PEM_read_bio_X509(bio_of(text).get(), nullptr, no_passphrase, nullptr),
                          X509_free);
  if (!certificate) throw std::runtime_error(path + " has no certificate in PEM");
  return certificate;
}

}  // namespace

std::string read_certificates(const std::string& path) {
  std::string text = read(path);
  certificate_in(text, path);
  return text;
}

KeyPair read_key_pair(const std::string& certificate_path, const std::string& key_path) {
  KeyPair pair{read(certificate_path), read(key_path)};
  const Certificate certificate = certificate_in(pair.certificates, certificate_path);
  const Key key(PEM_read_bio_PrivateKey(bio_of(pair.key).get(), nullptr, no_passphrase, nullptr),
                EVP_PKEY_free);
  if (!key) throw std::runtime_error(key_path + " has no key in PEM without a passphrase");
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    throw std::runtime_error("the key in " + key_path + " does not belong to the certificate in " +
                             certificate_path);
  }
  return pair;
}

}  // namespace weft
