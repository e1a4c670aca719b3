#include "tests/support/service/postgres.h"

#include <libpq-fe.h>
#include <pwd.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace weft::testing {
namespace {

namespace fs = std::filesystem;

// Of the newest version; empty where there is none.
fs::path programs() {
  fs::path newest;
  std::error_code error;
  for (const auto& version : fs::directory_iterator("/usr/lib/postgresql", error)) {
    const fs::path bin = version.path() / "bin";
    if (fs::exists(bin / "initdb", error)) newest = std::max(newest, bin);
  }
  return newest;
}

// PostgreSQL refuses root.
std::vector<std::string> as_nobody(const std::string& program, std::vector<std::string> arguments) {
  std::vector<std::string> words;
  if (geteuid() == 0)
    words = {"/usr/bin/setpriv", "--reuid=nobody", "--regid=nogroup", "--clear-groups", "--"};
  words.push_back(program);
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

Process run(std::vector<std::string> words, const std::string& output) {
  const std::string program = words.front();
  words.erase(words.begin());
  return {program, words, output, 0, {"LC_ALL=C"}};
}

// What /proc/PID/stat says behind the name: the state, the parent, ... Empty where there is none.
std::vector<std::string> facts_of(const std::string& process) {
  std::string stat;
  std::getline(std::ifstream("/proc/" + process + "/stat"), stat, '\0');
  std::istringstream facts(stat.substr(std::min(stat.size(), stat.rfind(')') + 1)));
  return {std::istream_iterator<std::string>(facts), {}};
}

// Every process whose parent it is, and itself.
std::vector<pid_t> family_of(pid_t parent) {
  std::vector<pid_t> family{parent};
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const auto facts = facts_of(name);
    if (facts.size() > 1 && facts[1] == std::to_string(parent)) family.push_back(std::stoi(name));
  }
  return family;
}

}  // namespace

bool Postgres::is_installed() { return !programs().empty(); }

Postgres::Postgres(std::vector<std::string> settings, std::vector<std::string> environment)
    : settings_(std::move(settings)), environment_(std::move(environment)) {
  if (!is_installed()) throw std::runtime_error("no PostgreSQL in /usr/lib/postgresql");
  if (const passwd* nobody = getpwnam("nobody"); geteuid() == 0 && nobody != nullptr) {
    if (chown(directory_.name().c_str(), nobody->pw_uid, nobody->pw_gid) != 0)
      throw std::runtime_error(directory_.name() + " cannot be given to nobody");
  }
  const std::string said = directory_.path("initdb.txt");
  const int code =
      run(as_nobody(programs() / "initdb", {"-D", directory_.path("data"), "-U", "weft", "-A",
                                            "trust", "--no-sync", "-E", "UTF8"}),
          said)
          .wait();
  if (code != 0) {
    std::string line;
    std::getline(std::ifstream(said), line, '\0');
    throw std::runtime_error("initdb ended with " + std::to_string(code) + ": " + line);
  }
  start();
}

Postgres::~Postgres() {
  if (!process_) return;
  process_->signal(SIGQUIT);
  process_->wait();
}

std::string Postgres::url() const {
  return "host=" + directory_.name() + " user=weft dbname=postgres";
}

void Postgres::stop() {
  process_->signal(SIGINT);
  process_->wait();
  process_.reset();
}

void Postgres::start() {
  std::vector<std::string> arguments{"-D", directory_.path("data"), "-k", directory_.name()};
  settings_.push_back("listen_addresses=");
  for (const std::string& setting : settings_) {
    arguments.push_back("-c");
    arguments.push_back(setting);
  }
  settings_.pop_back();
  const auto words = as_nobody(programs() / "postgres", arguments);
  process_.emplace(words.front(), std::vector(words.begin() + 1, words.end()),
                   directory_.path("postgres.txt"), 0, environment_);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (PQping(url().c_str()) != PQPING_OK) {
    if (std::chrono::steady_clock::now() > end)
      throw std::runtime_error("PostgreSQL does not serve within a minute");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void Postgres::freeze() const {
  for (const pid_t process : family_of(process_->id())) kill(process, SIGSTOP);
}

double Postgres::cpu_s() const {
  double ticks = 0;
  for (const pid_t process : family_of(process_->id())) {
    const auto facts = facts_of(std::to_string(process));
    if (facts.size() > 12) ticks += std::stod(facts[11]) + std::stod(facts[12]);
  }
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

void Postgres::thaw() const {
  for (const pid_t process : family_of(process_->id())) kill(process, SIGCONT);
}

}  // namespace weft::testing
