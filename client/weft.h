#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "client/output/terminal.h"

namespace weft::client {

// The whole of `weft`: runs the command that the arguments name and returns the exit code. A stop
// that is requested (Ctrl-C) ends it cleanly.
int run_weft(std::vector<std::string> arguments, const Terminal& terminal,
             const std::stop_token& stop);

}  // namespace weft::client
