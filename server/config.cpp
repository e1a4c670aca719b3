#include "server/config.h"

#include <toml++/toml.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <variant>
#include <vector>

#include "core/plan.h"

namespace weft {
namespace {

constexpr int kDefaultPort = 7311;
constexpr std::array kLogLevels = {"trace", "debug", "info", "warn", "error", "off"};

// A number that a flag and a key of the file set; "max_sessions" is --max-sessions.
struct Number {
  const char* key;
  std::variant<int*, std::int64_t*> target;
  std::int64_t low, high;
  const char* help;
};

std::vector<Number> numbers(Config& config) {
  ServerOptions& server = config.server;
  Limits& limits = server.limits;
  constexpr std::int64_t kMiB = 1 << 20, kMostParticles = 1'000'000'000;
  constexpr std::int64_t kMostAssets = kMiB << 24;
  constexpr std::int64_t kMostFrameWork = kMostParticles * kMaxSubsteps;
  return {
      {"port", &server.port, 0, 65535, "Port to listen on; 0 takes a free one"},
      {"workers", &server.worker_threads, 1, 1024, "Threads that advance sessions"},
      {"max_sessions", &limits.max_sessions, 1, 100'000, "Sessions at a time"},
      {"max_sessions_per_principal", &limits.max_sessions_per_principal, 1, 100'000,
       "Sessions of one principal at a time"},
      {"max_particles", &limits.max_particles_per_session, 4, kMostParticles,
       "Particles in one session"},
      {"max_frame_work", &limits.max_frame_work, 1, kMostFrameWork,
       "Particles times substeps of one frame"},
      {"max_particles_per_principal", &limits.max_particles_per_principal, 4, kMostParticles,
       "Particles of one principal"},
      {"max_total_particles", &limits.max_total_particles, 4, kMostParticles,
       "Particles in all sessions"},
      {"max_streams", &limits.max_streams, 1, 100'000, "Streams at a time"},
      {"max_streams_per_principal", &limits.max_streams_per_principal, 1, 100'000,
       "Streams of one principal at a time"},
      {"max_snapshots_per_session", &limits.max_snapshots_per_session, 1, 1000,
       "Snapshots on demand of one session"},
      {"max_asset_bytes", &limits.max_asset_bytes, kMiB, 1024 * kMiB, "Bytes of one asset"},
      {"max_asset_bytes_per_principal", &limits.max_asset_bytes_per_principal, kMiB, kMostAssets,
       "Bytes of all assets of one principal"},
      {"max_total_asset_bytes", &limits.max_total_asset_bytes, kMiB, kMostAssets,
       "Bytes of all assets"},
      {"asset_ttl_s", &config.asset_ttl_s, 0, 31'536'000,
       "Seconds after which an asset that no session names\nis deleted; 0: never"},
      {"idle_s", &config.idle_s, 0, 31'536'000,
       "Seconds after which an unused paused session\nis kept in the store alone; 0: never"},
      {"max_tests", &limits.max_tests, 1, 256, "Tests of textiles at a time"},
      {"history_bytes", &limits.history_bytes_per_session, kMiB, 1024 * kMiB * 64,
       "Bytes of frames a session keeps"},
      {"max_total_history_bytes", &limits.max_total_history_bytes, kMiB, kMiB << 24,
       "Bytes of frames all sessions keep; those that are\nread get more of them"},
      {"snapshot_ms", &server.snapshot_ms, 0, 3'600'000,
       "Milliseconds of computing between snapshots,\nat which restarts begin"},
  };
}

struct TlsOptions {
  std::optional<std::string> certificate, key, client_ca;
};

// A path or an address that a flag and a key of the file set; "data_dir" is --data-dir.
struct Text {
  const char* key;
  std::optional<std::string>* target;
  const char* type;
  std::string help;
};

// With those of `tls`, which set_tls puts together.
std::vector<Text> texts(Config& config, TlsOptions& tls) {
  ServerOptions& server = config.server;
  return {
      {"host", &server.host, "ADDRESS", "Address to listen on [" + *server.host + "]"},
      {"metrics", &server.metrics, "ADDRESS", "Address and port of Prometheus' metrics, or none"},
      {"data_dir", &server.data_dir, "DIR", "Directory that keeps sessions, or none"},
      {"database", &server.database, "URL",
       "PostgreSQL database that keeps them instead, for\nseveral servers, or none"},
      {"replica", &server.replica, "NAME",
       "What the others and the load balancer call this\nserver [the host's name]"},
      {"tls_cert", &tls.certificate, "FILE", "Certificate chain (PEM): encrypts, needs --tls-key"},
      {"tls_key", &tls.key, "FILE", "Its key (PEM, no passphrase)"},
      {"tls_client_ca", &tls.client_ca, "FILE",
       "Certificates (PEM): clients need one that these\nsigned, which says who they are"},
      {"tokens", &server.tokens, "FILE",
       "Who may call: lines PRINCIPAL SHA256 [admin], as\nweft token writes them"},
  };
}

// What a load balancer's configuration can spell.
bool is_replica(const std::string& name) {
  return !name.empty() && name.size() <= 63 &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
}

std::string flag_of(const char* key) {
  std::string flag = std::string("--") + key;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

[[noreturn]] void refuse(const std::string& text) { throw ConfigExit{"weftd: " + text + "\n", 2}; }

void set(const Number& number, std::int64_t value, const std::string& where) {
  if (value < number.low || value > number.high) {
    refuse(where + " is " + std::to_string(value) + ", not within " + std::to_string(number.low) +
           " to " + std::to_string(number.high));
  }
  std::visit([&](auto* target) { *target = static_cast<std::decay_t<decltype(*target)>>(value); },
             number.target);
}

void set_log_level(Config& config, const std::string& level, const std::string& where) {
  if (std::find(kLogLevels.begin(), kLogLevels.end(), level) == kLogLevels.end()) {
    refuse(where + " is \"" + level + "\", not trace, debug, info, warn, error or off");
  }
  config.log_level = level;
}

template <class Value>
Value value_of(const toml::node& node, const std::string& where, const char* type) {
  if (const auto value = node.value_exact<Value>()) return *value;
  refuse(where + " is not " + type);
}

void read_file(const std::string& path, Config& config, TlsOptions& tls) {
  if (!std::filesystem::is_regular_file(path)) refuse(path + " is no file");
  toml::table table;
  try {
    table = toml::parse_file(path);
  } catch (const toml::parse_error& error) {
    const auto line = error.source().begin.line;
    refuse(path + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
           std::string(error.description()));
  }
  const auto known = numbers(config);
  const auto known_texts = texts(config, tls);
  for (const auto& [name, node] : table) {
    const std::string key(name.str());
    const std::string where = path + ":" + std::to_string(node.source().begin.line) + ": " + key;
    const auto number = std::find_if(known.begin(), known.end(),
                                     [&](const Number& each) { return each.key == key; });
    const auto text = std::find_if(known_texts.begin(), known_texts.end(),
                                   [&](const Text& each) { return each.key == key; });
    if (number != known.end()) {
      set(*number, value_of<std::int64_t>(node, where, "a whole number"), where);
    } else if (text != known_texts.end()) {
      *text->target = value_of<std::string>(node, where, "a text");
    } else if (key == "insecure") {
      config.insecure = value_of<bool>(node, where, "true or false");
    } else if (key == "log_level") {
      set_log_level(config, value_of<std::string>(node, where, "a text"), where);
    } else {
      std::string keys = "insecure, log_level";
      for (const auto& each : known_texts) keys += std::string(", ") + each.key;
      for (const auto& each : known) keys += std::string(", ") + each.key;
      refuse(where + " is not known; there are " + keys);
    }
  }
}

// Of the service manager, or the user's own.
std::string default_data_dir() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (auto state = variable("STATE_DIRECTORY"); !state.empty()) return state;
  if (const auto state = variable("XDG_STATE_HOME"); !state.empty()) return state + "/weft";
  if (const auto home = variable("HOME"); !home.empty()) return home + "/.local/state/weft";
  return "/var/lib/weft";
}

void set_database(ServerOptions& server) {
  const char* variable = std::getenv("WEFT_DATABASE");
  if (!server.database && variable != nullptr) server.database = variable;
  if (server.database && (server.database->empty() || *server.database == "none"))
    server.database.reset();
  if (server.replica && !is_replica(*server.replica))
    refuse("replica is \"" + *server.replica + "\", not 1 to 63 characters of a-z, 0-9 and -");
}

void check_reach(const std::string& key, const std::string& value, const std::string& host,
                 const std::string& way_out) {
  if (is_loopback(host)) return;
  refuse(key + " is " + value + ", which other machines can reach, and nothing is encrypted; " +
         way_out + " --insecure if that is what you want");
}

void set_tls(Config& config, const TlsOptions& given) {
  if (!given.certificate && !given.key && !given.client_ca) return;
  if (!given.certificate || !given.key)
    refuse("tls_cert and tls_key are needed for TLS, one is missing");
  config.server.tls = ServerTls{*given.certificate, *given.key, given.client_ca};
}

// "HOST:PORT", or none.
void check_metrics(Config& config) {
  std::optional<std::string>& metrics = config.server.metrics;
  if (*metrics == "none") return metrics.reset();
  const std::size_t colon = metrics->rfind(':');
  const std::string port = colon == std::string::npos ? "" : metrics->substr(colon + 1);
  const bool digits = !port.empty() && port.size() <= 5 &&
                      port.find_first_not_of("0123456789") == std::string::npos;
  if (colon == 0 || !digits || std::stoi(port) > 65535)
    refuse("metrics is \"" + *metrics + "\", not an address and a port like 127.0.0.1:9464");
  if (!config.insecure) check_reach("metrics", *metrics, metrics->substr(0, colon), "add");
}

}  // namespace

bool is_loopback(const std::string& host) {
  const bool number = host.find_first_not_of("0123456789.") == std::string::npos;
  return host == "localhost" || host == "[::1]" || (number && host.starts_with("127."));
}

Config read_config(int argc, const char* const* argv) {
  Config config;
  config.server.port = kDefaultPort;
  config.server.data_dir = default_data_dir();

  CLI::App app("weftd - the Weft server: simulates textiles and streams their frames over gRPC.",
               "weftd");
  std::string file, log_level;
  bool insecure = false;
  app.add_option("--config", file, "TOML file; its keys are these flags, with _ for -")
      ->type_name("FILE");
  TlsOptions tls;
  const auto known_texts = texts(config, tls);
  std::vector<std::string> given_texts(known_texts.size());
  for (std::size_t i = 0; i < known_texts.size(); ++i) {
    app.add_option(flag_of(known_texts[i].key), given_texts[i], known_texts[i].help)
        ->type_name(known_texts[i].type);
  }
  app.add_flag("--insecure", insecure, "Allow a host other machines can reach, unencrypted");
  app.add_flag(
      "--until-eof", config.until_eof,
      "End, as on SIGTERM, when standard input does: with\nthe program that started this one");
  app.add_option("--log-level", log_level, "trace, debug, info, warn, error or off [info]")
      ->type_name("LEVEL");
  app.set_version_flag("--version", std::string("weftd ") + WEFT_VERSION);
  const auto known = numbers(config);
  std::vector<std::int64_t> values(known.size());
  for (std::size_t i = 0; i < known.size(); ++i) {
    const auto now =
        std::visit([](auto* target) { return std::to_string(*target); }, known[i].target);
    app.add_option(flag_of(known[i].key), values[i], std::string(known[i].help) + " [" + now + "]")
        ->type_name("N");
  }
  app.footer(
      "Prints \"weftd listening on ADDRESS:PORT\" when it serves; logs to stderr. SIGTERM\n"
      "or SIGINT ends every stream and call and exits with 0. Sessions are kept, unless\n"
      "told otherwise, in $STATE_DIRECTORY, $XDG_STATE_HOME/weft or\n"
      "~/.local/state/weft.\n"
      "\n"
      "Servers with the same --database share its sessions. The URL, or a connection\n"
      "string of libpq, can be in $WEFT_DATABASE instead, its password in a PGPASSFILE;\n"
      "neither is logged.\n"
      "\n"
      "Files of TLS are read anew within seconds of a change; while certificate and key\n"
      "do not belong together, no new connection is taken. Tokens are read once, at the\n"
      "start. With --tokens or --tls-client-ca, sessions are their principal's: whom a\n"
      "token names or, where none is sent, the common name of the client's certificate.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    throw ConfigExit{app.help(), 0};
  } catch (const CLI::CallForVersion&) {
    throw ConfigExit{app.version() + "\n", 0};
  } catch (const CLI::ParseError& error) {
    refuse(std::string(error.what()) + "; see weftd --help");
  }

  // flags last, so that they win
  if (!file.empty()) read_file(file, config, tls);
  for (std::size_t i = 0; i < known.size(); ++i) {
    const std::string flag = flag_of(known[i].key);
    if (app.count(flag) > 0) set(known[i], values[i], flag);
  }
  for (std::size_t i = 0; i < known_texts.size(); ++i)
    if (app.count(flag_of(known_texts[i].key)) > 0) *known_texts[i].target = given_texts[i];
  config.insecure |= insecure;
  config.server.idle = std::chrono::seconds(config.idle_s);
  config.server.asset_ttl = std::chrono::seconds(config.asset_ttl_s);
  set_tls(config, tls);
  if (config.server.metrics) check_metrics(config);
  if (config.server.data_dir->empty()) refuse("data_dir is empty; give a directory, or none");
  if (*config.server.data_dir == "none") config.server.data_dir.reset();
  set_database(config.server);
  if (app.count("--log-level") > 0) set_log_level(config, log_level, "--log-level");
  if (!config.insecure && !config.server.tls)
    check_reach("host", *config.server.host, *config.server.host, "give --tls-cert, or add");
  return config;
}

}  // namespace weft
