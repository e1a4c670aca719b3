#pragma once

#include <cstdint>
#include <string>

#include "server/server.h"

namespace weft {

// What weftd was told to do.
struct Config {
  ServerOptions server;
  std::int64_t idle_s = 3600, asset_ttl_s = 86'400;
  bool insecure = false;   // may listen beyond this machine, without encryption
  bool until_eof = false;  // ends when standard input does
  std::string log_level = "info";
};

// Whether only this machine reaches the host, "127.0.0.1".
bool is_loopback(const std::string& host);

// What ends weftd before it begins: something to print, and the exit code.
struct ConfigExit {
  std::string text;
  int code = 0;  // 0: help or version, for stdout
};

// Reads flags and the file they may name; flags win. Throws ConfigExit: with every bad value named
// by its flag, or by file, line and key, and its bound.
Config read_config(int argc, const char* const* argv);

}  // namespace weft
