#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/rand.h>
#include <openssl/sha.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "client/commands/commands.h"

namespace weft::client {
namespace {

using Bytes = std::array<unsigned char, 32>;

struct TokenOptions {
  std::string principal;
  std::string output;
  bool admin = false;
};

std::string hex(const Bytes& bytes) { return fmt::format("{:02x}", fmt::join(bytes, "")); }

// In a new file that nobody else can read.
void write_secret(const std::string& path, const std::string& text) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0 && errno == EEXIST)
    throw unwritable(path, "it is there; a token is not written over another");
  const bool written =
      file >= 0 && write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = errno;
  if (file >= 0) close(file);
  if (!written) throw unwritable(path, std::strerror(error));
}

void run_token(Context& context, const TokenOptions& options) {
  const bool word = std::none_of(options.principal.begin(), options.principal.end(),
                                 [](char c) { return c <= ' ' || c > '~' || c == '#'; });
  if (options.principal.empty() || !word) {
    throw usage_problem("PRINCIPAL is \"" + options.principal +
                        "\", not a word of ASCII characters without #");
  }
  Bytes random, hash;
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1)
    throw Problem(Exit::kRefused, "UNAVAILABLE", "NO_RANDOMNESS", "no random numbers can be had");
  const std::string token = hex(random);
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash.data());
  write_secret(options.output, token + '\n');
  const std::string line =
      fmt::format("{} {}{}", options.principal, hex(hash), options.admin ? " admin" : "");
  context.answer({{"line", line}, {"token_file", options.output}}, line + '\n');
}

}  // namespace

void add_token(CLI::App& app, Context& context) {
  auto options = std::make_shared<TokenOptions>();
  CLI::App* command =
      app.add_subcommand("token", "Make a token, and the line for weftd --tokens with its hash");
  command->add_option("PRINCIPAL", options->principal, "Whose it is")->option_text(" ")->required();
  command->add_option("-o,--output", options->output, "Where the token goes, for --token-file")
      ->type_name("FILE")
      ->required();
  command->add_flag("--admin", options->admin, "May use the sessions of all");
  command->footer("weft token ann -o ann.token >> tokens");
  command->callback([&context, options] { run_token(context, *options); });
}

}  // namespace weft::client
