#pragma once

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace weft::testing {

inline std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Files of a certificate and its key.
struct CertificateFiles {
  std::string certificate, key;
};

// Signs certificates for this machine; all its files are PREFIX.crt and PREFIX.key.
class CertificateAuthority {
 public:
  explicit CertificateAuthority(const std::string& prefix) : prefix_(prefix) {
    openssl("req -x509 " + kNewKey + " -days 2 -subj /CN=authority" + files(prefix, "-out"));
  }
  std::string certificate() const { return prefix_ + ".crt"; }

  // Of somebody's, for so many days; below 0 it has expired.
  CertificateFiles sign(const std::string& prefix, const std::string& name, int days = 2) const {
    openssl("req " + kNewKey + " -subj /CN=" + name + " -addext subjectAltName=IP:127.0.0.1" +
            files(prefix, "-out") + ".request");
    openssl("x509 -req -copy_extensions copy -CAcreateserial -in " + prefix + ".crt.request -CA " +
            certificate() + " -CAkey " + prefix_ + ".key -out " + prefix + ".crt -days " +
            std::to_string(days));
    return {prefix + ".crt", prefix + ".key"};
  }

 private:
  inline static const std::string kNewKey = "-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";

  static std::string files(const std::string& prefix, const std::string& out) {
    return " -keyout " + prefix + ".key " + out + " " + prefix + ".crt";
  }
  static void openssl(const std::string& arguments) {
    if (std::system(("openssl " + arguments + " 2>/dev/null").c_str()) != 0)
      throw std::runtime_error("openssl " + arguments + " failed");
  }

  std::string prefix_;
};

}  // namespace weft::testing
