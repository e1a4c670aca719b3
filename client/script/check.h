#pragma once

#include "client/connection.h"
#include "client/script/script.h"

namespace weft::client {

// Holds a script to what can be known before it runs: the server is asked about every scene and
// every change of a textile, and files that would be written must not be there, unless they are
// replaced. Throws all that is wrong.
void check_script(Connection& connection, const Script& script, bool replace);

}  // namespace weft::client
