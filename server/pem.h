#pragma once

#include <string>

// Files of certificates and keys, in PEM.
namespace weft {

// All of a file with certificates. Throws std::runtime_error where it cannot be read or has none.
std::string read_certificates(const std::string& path);

struct KeyPair {
  std::string certificates, key;
};

// Throws std::runtime_error where one of both cannot be read, or they do not belong together.
KeyPair read_key_pair(const std::string& certificate, const std::string& key);

}  // namespace weft
